// Tables: a click on the title of a column puts the rows in its order, and where the columns do not
// fit beside each other, each row is a list of its cells with their titles.

const LEAST_ROWS = 3;

// What a cell is sorted by: its number, its text, or nothing where it is empty.
function sortedBy(cell) {
  const text = cell.textContent.trim();
  return text && cell.classList.contains("number") ? Number(text) : text;
}

function compared(a, b) {
  if (a === "" || b === "") return (a === "") - (b === "");
  if (typeof a === "number") return a - b;
  return a.localeCompare(b, "en", { numeric: true });
}

// In order of column k, up or down; empty cells stand last in both.
function inOrder(rows, k, down) {
  const values = new Map(rows.map((row) => [row, sortedBy(row.cells[k])]));
  return [...rows].sort((one, other) => {
    const [a, b] = [values.get(one), values.get(other)];
    const empty = a === "" || b === "";
    return compared(a, b) * (down && !empty ? -1 : 1);
  });
}

function makeSortable(table) {
  const [body] = table.tBodies;
  const rows = [...body.rows];
  const titles = [...table.tHead.rows[0].cells];
  titles.forEach((title, k) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...title.childNodes);
    title.append(button);
    button.addEventListener("click", () => {
      const before = title.getAttribute("aria-sort");
      const next = { ascending: "descending", descending: "" }[before] ?? "ascending";
      titles.forEach((other) => other.removeAttribute("aria-sort"));
      if (next) title.setAttribute("aria-sort", next);
      body.append(...(next ? inOrder(rows, k, next === "descending") : rows));
    });
  });
}

function nameCells(table) {
  const titles = [...table.tHead.rows[0].cells].map(({ textContent }) => textContent);
  for (const row of table.tBodies[0].rows) {
    [...row.cells].forEach((cell, k) => (cell.dataset.title = titles[k]));
  }
}

function fit(box) {
  box.classList.remove("stacked");
  box.classList.toggle("stacked", box.scrollWidth > box.clientWidth + 1);
}

export function openTables() {
  const boxes = [...document.querySelectorAll(".table")];
  for (const box of boxes) {
    const table = box.querySelector("table");
    nameCells(table);
    if (!box.classList.contains("kept") && table.tBodies[0].rows.length >= LEAST_ROWS) {
      makeSortable(table);
      box.classList.add("sorts");
    }
  }
  boxes.forEach(fit);
  addEventListener("resize", () => boxes.forEach(fit));
}
