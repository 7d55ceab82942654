// Light or dark, as the system asks for or the button says.

const theme = {
  chosen: null,
  listeners: [],
  get dark() {
    return this.chosen ? this.chosen === "dark"
                       : matchMedia("(prefers-color-scheme: dark)").matches;
  },
  toggle() {
    this.chosen = this.dark ? "light" : "dark";
    document.documentElement.dataset.theme = this.chosen;
    this.changed();
  },
  changed() {
    for (const listener of this.listeners) listener();
  },
  /** A colour of page.css, for canvases. */
  css(name) {
    return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  },
};
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => theme.changed());

