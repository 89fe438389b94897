// Layers of the map in drawing order, and their colors.

export const LAYERS = [
  { id: "map", name: "Robot map", key: "1", sign: "area" },
  { id: "global", name: "Global costmap", key: "2", sign: "area", off: true },
  { id: "near", name: "Local costmap", key: "l", sign: "area", off: true },
  { id: "zones", name: "Zones and ramps", key: "3", sign: "area" },
  { id: "goals", name: "Goals", key: "4", sign: "ring" },
  { id: "plan", name: "Plan", key: "5", sign: "line" },
  { id: "local", name: "Local plan", key: "6", sign: "line" },
  { id: "things", name: "Objects and pedestrians", key: "7", sign: "area" },
  { id: "scan", name: "Scan (at estimated pose)", key: "8", sign: "dots" },
  { id: "belief", name: "Belief with particles, 95 % ellipse", key: "9", sign: "dash" },
  { id: "truth", name: "Robot and path (ground truth)", key: "0", sign: "line" },
];

/** Return the ID of the layer of a costmap topic. */
export function layerOf(costmap) {
  return costmap.name.includes("local_costmap") ? "near" : "global";
}

const COLORS = ["page", "ink", "faint", "rule", "free", "wall", "unknown", "zone", "goal", "plan", "local", "thing", "person", "scan",
  "belief", "truth", "other", "bad", "odd", "good", "fault", "select", "ground"];

/** Return the current colors of the page, which depend on the theme. */
export function colorsNow() {
  const style = getComputedStyle(document.documentElement);
  return Object.fromEntries(COLORS.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}
