// What the pages of studies and of branches share: their data, words and numbers, ticks, commands.

const byId = id => document.getElementById(id);
const study = JSON.parse(byId("study-data").textContent);

function bytesOf(text) {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; i++) bytes[i] = binary.charCodeAt(i);
  return bytes;
}
const doubles = text => new Float64Array(bytesOf(text).buffer);

// Words for a variable and its values.
const words = name => name.replaceAll("_", " ");
const unitOf = column => (column.units && column.units !== "1" ? ` ${column.units}` : "");
const exact = value => String(value);
const rounded = value => (Number.isInteger(value) && Math.abs(value) < 1e9 ? String(value) : String(Number(value.toPrecision(9))));

const css = name => getComputedStyle(document.documentElement).getPropertyValue(name);

// Round values between two ends: 1, 2 or 5 times a power of ten; on a logarithmic axis powers of ten where there are two.
function ticks(low, high, logarithmic, count) {
  if (logarithmic) {
    const first = Math.ceil(low / Math.LN10 - 1e-9), last = Math.floor(high / Math.LN10 + 1e-9);
    if (last > first) {
      const step = Math.ceil((last - first) / count);
      return Array.from({ length: Math.floor((last - first) / step) + 1 }, (_, i) => [(first + i * step) * Math.LN10, `1e${first + i * step}`]);
    }
    return ticks(Math.exp(low), Math.exp(high), false, count).map(([at, text]) => [Math.log(at), text]);
  }
  const wish = (high - low) / count, power = 10 ** Math.floor(Math.log10(wish));
  const step = [1, 2, 5, 10].map(k => k * power).find(step => step >= wish * 0.999);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push([k * step, rounded(k * step)]);
  return found;
}

// As a POSIX shell takes it.
const inShell = text => (/^[A-Za-z0-9_./=:,+-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`);

// A row of the table of values.
const row = (name, value, title) => {
  const line = document.createElement("tr"), cells = [name, value].map(text => {
    const cell = line.appendChild(document.createElement("td"));
    cell.textContent = text;
    return cell;
  });
  cells[1].className = "number";
  line.title = title;
  return line;
};

// The command below the heading, for the clipboard.
byId("copy").addEventListener("click", async () => {
  try {
    await navigator.clipboard.writeText(byId("command").textContent);
    byId("copied").textContent = "copied";
  } catch {
    getSelection().selectAllChildren(byId("command"));
    byId("copied").textContent = "marked: copy it with the keyboard";
  }
});
