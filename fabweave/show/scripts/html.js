/**
 * The element of the page that has an id; which kind it is the page's HTML says.
 *
 * @type {(id: string) => any}
 */
export const by = (id) => document.getElementById(id);

/**
 * Write text into HTML.
 *
 * @param {unknown} text
 */
export function escaped(text) {
  return String(text).replace(/[&<>"']/g, (sign) => `&#${sign.charCodeAt(0)};`);
}

/**
 * Turn up one of several tabs, and its panel.
 *
 * @param {string[]} names
 * @param {string} chosen
 */
export function turnUp(names, chosen) {
  for (const name of names) {
    by(`tab-${name}`).setAttribute("aria-selected", name === chosen);
    by(`panel-${name}`).hidden = name !== chosen;
  }
}

/**
 * A value that a page keeps between visits, where the browser lets it.
 *
 * @param {() => Storage} store
 * @param {string} key
 */
export function memory(store, key) {
  return {
    /** @returns {any} */
    read() {
      try {
        return JSON.parse(store().getItem(key) ?? "null");
      } catch {
        return null;
      }
    },
    /** @param {unknown} value */
    write(value) {
      try {
        store().setItem(key, JSON.stringify(value));
      } catch {
        // Private windows, strict settings and full stores refuse; the page works without.
      }
    },
  };
}
