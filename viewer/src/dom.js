// Elements of the page.

export function element(name, attributes = {}, ...children) {
  const out = document.createElement(name);
  Object.entries(attributes).forEach(([key, value]) => out.setAttribute(key, value));
  out.append(...children);
  return out;
}
