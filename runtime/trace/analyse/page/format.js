// Text and elements.

/** An element; attributes that are functions listen, text and elements are its content. */
function element(tag, attributes = {}, ...content) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") node.addEventListener(name, value);
    else if (value !== null && value !== false) node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...content.filter((part) => part !== null && part !== undefined));
  return node;
}

/** Three significant digits. */
function number(value, digits = 3) {
  if (!Number.isFinite(value)) return "–";
  if (Number.isInteger(value) && Math.abs(value) < 1e15) return value.toLocaleString("en-US");
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-3) return value.toExponential(digits - 1);
  const after = Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
  return value.toLocaleString("en-US", { minimumFractionDigits: after, maximumFractionDigits: after });
}

const timeUnits = [[1, "s"], [1e-3, "ms"], [1e-6, "µs"], [1e-9, "ns"]];

function time(seconds) {
  if (!Number.isFinite(seconds)) return "–";
  if (seconds === 0) return "0 s";
  const size = Math.abs(seconds) * 1.0005;  // 999.6 µs is 1.00 ms
  const [unit, name] = timeUnits.find(([u]) => size >= u) ?? timeUnits[3];
  const value = seconds / unit;
  return `${unit === 1e-9 ? number(Math.round(10 * value) / 10) : number(value)} ${name}`;
}

/** A time of the run, as exact as a range of `span` needs. */
function moment(seconds, span) {
  const [unit, name] = timeUnits.find(([u]) => span >= 2 * u) ?? timeUnits[2];
  const after = Math.max(0, Math.min(6, 2 - Math.floor(Math.log10(Math.max(span / unit, 1e-9)))));
  return `${(seconds / unit).toLocaleString("en-US", {
    minimumFractionDigits: after, maximumFractionDigits: after })} ${name}`;
}

function bytes(value) {
  const units = ["B", "kB", "MB", "GB", "TB"];
  const k = Math.min(4, Math.max(0, Math.floor(Math.log10(Math.max(value, 1)) / 3)));
  return `${number(k === 0 ? value : value / 1000 ** k)} ${units[k]}`;
}

const percent = (share) =>
  Number.isFinite(share) ? `${(100 * share).toFixed(Math.abs(share) < 0.0995 ? 1 : 0)} %` : "–";

const count = (n, thing, many = `${thing}s`) => `${number(n)} ${n === 1 ? thing : many}`;
