// Form of the selected object, made from the fields that editor/forms.py returns.

import { el, fill } from "./dom.js";

const NUMBER = /^[-+]?(\d+\.?\d*|\.\d+)$/;

/** Return the value of a number field: a number, or a text with a unit. */
export function fieldValue(text) {
  const plain = text.trim();
  return NUMBER.test(plain) ? Number(plain) : plain;
}

/** Return whether a list contains the coordinates of a point of a line, a trigger, or an action. */
function isPoint(field) {
  const key = field.keys.at(-1);
  return field.type === "list" && field.fields.length === 2 && field.fields.every((one) => one.type === "number") && (Number.isInteger(key) || key === "of" || key === "at");
}

export class Form {
  /** `change(edits, what)` is called with the edits of a field. */
  constructor(element, change) {
    this.element = element;
    this.change = change;
  }

  /** Show a form below a heading, followed by the elements `more`. The focus stays in the same field. */
  show(heading, form, editable, more = []) {
    const focused = this.element.contains(document.activeElement) ? document.activeElement.dataset.path : null;
    this.editable = editable;
    const parts = form ? [form.help ? this.about(form) : null, ...this.contents(form)] : [];
    fill(this.element, el("h2", {}, heading), ...more, ...parts);
    const same = focused && [...this.element.querySelectorAll("[data-path]")].find((one) => one.dataset.path === focused);
    if (same) same.focus();
  }

  /** Return the help of the form, collapsed if it is long. */
  about(form) {
    if (form.help.length < 140) return el("p", { class: "help quiet" }, form.help);
    return el("details", {}, el("summary", {}, "What this is"), ...form.help.split("\n\n").map((part) => el("p", {}, part)));
  }

  contents(field) {
    if (field.omitted) return [el("p", { class: "quiet" }, `${field.omitted} values: edit them on the map or in the text.`)];
    if (field.type !== "group" && field.type !== "list") return [this.field(field)];
    const names = isPoint(field) ? ["x", "y"] : null;
    const fields = field.fields.map((one, index) => this.field(one, field.type === "list", names?.[index]));
    const list = field.type === "list" && field.fields.every((one) => one.type === "number") ? [el("div", { class: "items" }, ...fields)] : fields;
    return [...list, this.adder(field)];
  }

  field(field, item = false, called = "") {
    const label = called || (item ? `${Number(field.key) + 1}` : field.key);
    if (field.type === "group" || field.type === "list") {
      return el("fieldset", {}, el("legend", {}, item ? `${field.keys.at(-2)} ${label}` : label), field.help ? el("p", { class: "help quiet" }, field.help) : null,
        ...this.contents(field), this.remover(field));
    }
    const path = field.keys.join("/"), id = `field-${path}`, help = `help-${path}`;
    const text = [field.help, field.example && !item ? `for example ${field.example}` : ""].filter(Boolean).join(" · ");
    const name = item ? `${field.keys.at(-2)} ${label}` : null;
    return el("div", { class: "field" }, el("label", { for: id }, label),
      el("div", { class: "row" }, this.input(field, { id, "data-path": path, "aria-describedby": text ? help : null, "aria-label": name, disabled: !this.editable }), this.remover(field)),
      text ? el("p", { class: "help", id: help }, text) : null);
  }

  input(field, given) {
    const set = (value) => this.change([{ op: "set", keys: field.keys, value }], `${field.key} set to ${value}`);
    if (field.type === "choice") {
      const options = field.choices.map((one) => el("option", { value: JSON.stringify(one), selected: one === field.value }, String(one)));
      return el("select", { ...given, onchange: (event) => set(JSON.parse(event.target.value)) }, ...options);
    }
    const read = field.type === "number" ? fieldValue : (text) => text;
    const onchange = (event) => event.target.value !== field.value && set(read(event.target.value));
    if (field.type === "long text") {
      const area = el("textarea", { ...given, onchange });
      area.value = field.value;
      return area;
    }
    return el("input", { ...given, value: field.value, onchange, inputmode: null, autocomplete: "off" });
  }

  remover(field) {
    if (field.required || !field.written || !this.editable || typeof field.keys.at(-1) === "number") return null;
    const remove = () => this.change([{ op: "remove", keys: field.keys }], `${field.key} removed`);
    return el("button", { "aria-label": `Remove ${field.key}`, onclick: remove }, "×");
  }

  adder(field) {
    if (!field.addable.length || !this.editable) return null;
    const options = field.addable.map((one, k) => el("option", { value: k, title: one.help }, one.key));
    const chosen = (event) => {
      const one = field.addable[Number(event.target.value)];
      if (event.target.value !== "") this.change([{ op: "set", keys: [...field.keys, one.key], value: one.value }], `${one.key} added`);
    };
    const name = field.key && !NUMBER.test(field.key) ? `Add a key to ${field.key}` : "Add a key";
    return el("select", { "aria-label": name, onchange: chosen, "data-path": `add-${field.keys.join("/")}` }, el("option", { value: "" }, `${name}…`), ...options);
  }
}
