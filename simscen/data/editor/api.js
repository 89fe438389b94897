// Requests to the program that serves this page.

/** Error for a request that the program refused; the message is the reason, `data` are the other keys of the answer. */
export class Refused extends Error {
  constructor(status, data) {
    super(data.error ?? "simscen edit does not answer as expected");
    this.status = status;
    this.data = data;
  }
}

/** Send a request, and return the answer. Throws Refused, also if the program has ended. */
export async function ask(name, data = {}) {
  let answer;
  try {
    answer = await fetch(`api/${name}`, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(data) });
  } catch {
    throw new Refused(0, { error: "simscen edit does not answer; start it again in the terminal. Your text is still here: copy it." });
  }
  let content = {};
  try {
    content = await answer.json();
  } catch { /* the message below says so */ }
  if (!answer.ok) throw new Refused(answer.status, content);
  return content;
}
