// Hash of the address: #t=12.4 is the shown time in s; &v=2 (a verdict) or &e=17 (an event) is the selection.

/** Return {time, selected} from a hash; null for what it does not contain. */
export function fromHash(hash) {
  const said = new URLSearchParams(hash.replace(/^#/, ""));
  const time = said.has("t") && said.get("t") !== "" ? Number(said.get("t")) : NaN;
  const selected = ["v", "e"].filter((kind) => /^\d+$/.test(said.get(kind) ?? "")).map((kind) => ({ kind, number: Number(said.get(kind)) }));
  return { time: Number.isFinite(time) && time >= 0 ? time : null, selected: selected[0] ?? null };
}

/** Return the hash for a time in s and a selection. */
export function toHash(time, selected) {
  const moment = `#t=${Number(time.toFixed(3))}`;
  return selected ? `${moment}&${selected.kind}=${selected.number}` : moment;
}
