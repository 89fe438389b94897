// Creation of HTML and SVG elements. Text is never interpreted as markup, whatever a scenario contains.

const SVG = "http://www.w3.org/2000/svg";

/** Return an HTML element with attributes, properties (`on…` are listeners), and children (elements or text). */
export function el(tag, given = {}, ...children) {
  return filled(document.createElement(tag), given, children);
}

/** Return an SVG element in the same way. */
export function svg(tag, given = {}, ...children) {
  return filled(document.createElementNS(SVG, tag), given, children);
}

function filled(element, given, children) {
  for (const [name, value] of Object.entries(given)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else element.setAttribute(name, value === true ? "" : String(value));
  }
  element.append(...children.filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

/** Replace all children of an element. */
export function fill(element, ...children) {
  element.replaceChildren(...children.filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

/** Return a time such as "14.60 s", or "2:14.60" from one minute on. */
export function clockText(seconds) {
  const shown = Math.max(0, seconds);
  if (shown < 60) return `${shown.toFixed(2)} s`;
  const minutes = Math.floor(shown / 60);
  return `${minutes}:${(shown - 60 * minutes).toFixed(2).padStart(5, "0")}`;
}
