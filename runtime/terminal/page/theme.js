// What all pages share: light or dark, as the system asks for or the button says; texts as bytes.

const byId = (id) => document.getElementById(id);

const theme = {
  chosen: null,
  listeners: [],
  get dark() {
    return this.chosen ? this.chosen === "dark"
                       : matchMedia("(prefers-color-scheme: dark)").matches;
  },
  toggle() { this.choose(this.dark ? "light" : "dark"); },
  /** "light", "dark", or null: as the system asks for. */
  choose(name) {
    this.chosen = name;
    if (name) document.documentElement.dataset.theme = name;
    else delete document.documentElement.dataset.theme;
    this.changed();
  },
  changed() {
    for (const listener of this.listeners) listener();
  },
  /** A colour of base.css, for canvases. */
  css(name) {
    return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  },
};
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => theme.changed());

function themeButton() {
  const button = byId("theme"), name = () => { button.textContent = theme.dark ? "light" : "dark"; };
  button.hidden = false;
  button.addEventListener("click", () => theme.toggle());
  theme.listeners.push(name);
  name();
}

function bytesOf(base64) {
  const text = atob(base64), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}
