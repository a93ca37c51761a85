// A table whose headings sort it.

/** Sort by the column of a heading that is clicked: rising, and falling at the second click; blanks stay last. */
function makeSortable(table) {
  for (const [column, head] of [...table.tHead.rows[0].cells].entries()) {
    head.querySelector("button").addEventListener("click", () => {
      const falling = head.getAttribute("aria-sort") === "ascending";
      for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", falling ? "descending" : "ascending");
      const rows = [...table.tBodies[0].rows].sort((a, b) => compareCells(a.cells[column], b.cells[column], falling));
      table.tBodies[0].append(...rows);
    });
  }
}

function compareCells(a, b, falling) {
  if (isBlank(a) || isBlank(b)) return isBlank(a) - isBlank(b);
  const order = "value" in a.dataset
    ? Number(a.dataset.value) - Number(b.dataset.value)
    : a.innerText.localeCompare(b.innerText, "en", { numeric: true });
  return falling ? -order : order;
}

function isBlank(cell) {
  return cell.textContent === "–";
}
