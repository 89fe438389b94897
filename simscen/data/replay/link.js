// The address of a moment: #t=12.4, and what is selected: &v=2 (a verdict) or &e=17 (an event).

/** {time, selected} of a hash; null for what it does not say. */
export function fromHash(hash) {
  const said = new URLSearchParams(hash.replace(/^#/, ""));
  const time = said.has("t") && said.get("t") !== "" ? Number(said.get("t")) : NaN;
  const selected = ["v", "e"].filter((kind) => /^\d+$/.test(said.get(kind) ?? "")).map((kind) => ({ kind, number: Number(said.get(kind)) }));
  return { time: Number.isFinite(time) && time >= 0 ? time : null, selected: selected[0] ?? null };
}

/** The hash of a moment in seconds and of what is selected. */
export function toHash(time, selected) {
  const moment = `#t=${Number(time.toFixed(3))}`;
  return selected ? `${moment}&${selected.kind}=${selected.number}` : moment;
}
