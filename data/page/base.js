// What every page has: its document, elements, numbers from base64, light and dark, legends, a command to copy.

const byId = id => document.getElementById(id);
const page = JSON.parse(byId("page-data").textContent);

// Typed arrays have the byte order of the machine; every machine with a browser today is little-endian, as the data.
function bytesOf(text) {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; i++) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

const doubles = text => new Float64Array(bytesOf(text).buffer);
const codes = text => new Int8Array(bytesOf(text).buffer);

// Every text of a file becomes the content of an element, never markup.
function element(name, content, className) {
  const made = document.createElement(name);
  if (content !== undefined) made.textContent = content;
  if (className) made.className = className;
  return made;
}

// T_f is a symbol with its index: one letter, and one or two after the underscore. Every third part is an index.
const SYMBOL = /(?<![\p{L}\p{N}_])(\p{L})_([\p{L}\p{N}]{1,2})(?![\p{L}\p{N}_])/u;
const partsOf = text => text.split(SYMBOL);
const typeset = text => partsOf(text).map((part, k) => (k % 3 === 2 ? element("sub", part) : part));

// Rows of texts; the first column is a name, and `numbers` is the first column of numbers.
function tableOf(header, rows, numbers = Infinity) {
  const table = element("table");
  if (header) {
    const line = table.appendChild(element("thead")).appendChild(element("tr"));
    header.forEach((text, k) => line.appendChild(element("th", text)).style.textAlign = k >= numbers ? "right" : "left");
  }
  const body = table.appendChild(element("tbody"));
  for (const row of rows) {
    const line = body.appendChild(element("tr"));
    row.forEach((text, k) => line.appendChild(element("td", undefined, k >= numbers ? "number" : k === 0 ? "name" : "")).append(...(k ? [text] : typeset(text))));
  }
  return table;
}

// An entry of a legend: a swatch and its name.
function keyEntry(swatch, name) {
  const entry = element("span");
  entry.append(swatch, ...typeset(name));
  return entry;
}

function swatch(className, style) {
  const made = element("i", undefined, className);
  Object.assign(made.style, style);
  return made;
}

const lineSwatch = (colour, style = "solid") => swatch("line", { borderTopColor: inked(colour), borderTopStyle: style });

// A button that copies the text of an element, or marks it where the browser does not let a page copy, and what it did.
function copyButton(source) {
  const button = element("button", "Copy the command"), said = element("span");
  button.type = "button";
  said.setAttribute("role", "status");
  button.addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(source.textContent);
      said.textContent = "copied";
    } catch {
      getSelection().selectAllChildren(source);
      said.textContent = "marked: copy it with the keyboard";
    }
  });
  return [button, said];
}

// What is drawn again when the colours change.
const onTheme = [], DARK = matchMedia("(prefers-color-scheme: dark)");
let asked = "";
function showTheme() {
  document.documentElement.dataset.theme = asked || (DARK.matches ? "dark" : "light");
  byId("theme").textContent = document.documentElement.dataset.theme === "dark" ? "Light" : "Dark";
  palette = new Map();
  for (const draw of onTheme) draw();
}
byId("theme").addEventListener("click", () => {
  asked = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
  showTheme();
});
DARK.addEventListener("change", showTheme);

byId("subtitle").textContent = page.subtitle;
byId("notice").textContent = page.notice || "";
byId("notice").hidden = !page.notice;
