// What a map can show, in the order in which it is drawn, with the color that stands for it.

export const LAYERS = [
  { id: "map", name: "Map of the robot", key: "1", sign: "area" },
  { id: "global", name: "Global costmap", key: "2", sign: "area", off: true },
  { id: "near", name: "Local costmap", key: "l", sign: "area", off: true },
  { id: "zones", name: "Zones and ground", key: "3", sign: "area" },
  { id: "goals", name: "Goals", key: "4", sign: "ring" },
  { id: "plan", name: "Plan", key: "5", sign: "line" },
  { id: "local", name: "Local plan", key: "6", sign: "line" },
  { id: "things", name: "Things and people", key: "7", sign: "area" },
  { id: "scan", name: "Scan, from the belief", key: "8", sign: "dots" },
  { id: "belief", name: "Belief, particles, 95 % ellipse", key: "9", sign: "dash" },
  { id: "truth", name: "Robot and its way (truth)", key: "0", sign: "line" },
];

/** Which of the layers a costmap of the log is. */
export function layerOf(costmap) {
  return costmap.name.includes("local_costmap") ? "near" : "global";
}

const COLORS = ["page", "ink", "faint", "rule", "free", "wall", "unknown", "zone", "goal", "plan", "local", "thing", "person", "scan",
  "belief", "truth", "other", "bad", "odd", "good", "fault", "select", "ground"];

/** The colors of the page as they are now. */
export function colorsNow() {
  const style = getComputedStyle(document.documentElement);
  return Object.fromEntries(COLORS.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}
