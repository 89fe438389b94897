// Undo and redo of texts.

const MOST = 500;

/** The texts before and after the current one. Changes of one `group` in quick succession are one step. */
export class History {
  constructor(text) {
    this.text = text;
    this.before = [];
    this.after = [];
    this.group = "";
    this.time = 0;
  }

  /** Make a text the current one. */
  push(text, group = "", now = Date.now()) {
    if (text === this.text) return;
    const joined = group !== "" && group === this.group && now - this.time < 1000 && this.before.length > 0;
    if (!joined) this.before.push(this.text);
    if (this.before.length > MOST) this.before.shift();
    this.text = text;
    this.after = [];
    this.group = group;
    this.time = now;
  }

  /** Go back by one step. Returns the text, or null if there is no earlier one. */
  undo() {
    if (!this.before.length) return null;
    this.after.push(this.text);
    this.text = this.before.pop();
    this.group = "";
    return this.text;
  }

  /** Go forward by one step. Returns the text, or null if there is no later one. */
  redo() {
    if (!this.after.length) return null;
    this.before.push(this.text);
    this.text = this.after.pop();
    this.group = "";
    return this.text;
  }
}
