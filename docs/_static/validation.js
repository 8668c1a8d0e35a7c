// Filter of the table of validation rows: words that a row must contain, its verdict, its theme.
document.addEventListener("DOMContentLoaded", () => {
  const table = document.getElementById("validation-rows");
  if (!table) return;
  const rows = [...table.tBodies[0].rows];
  const texts = rows.map((row) => row.textContent.toLowerCase());
  const control = (name) => document.getElementById(`validation-${name}`);
  const show = () => {
    const words = control("words").value.toLowerCase().split(/\s+/).filter(Boolean);
    const theme = control("theme").value, verdict = control("verdict").value;
    let shown = 0;
    rows.forEach((row, i) => {
      const kept = (!theme || row.cells[row.cells.length - 1].textContent === theme)
        && (!verdict || row.cells[6].textContent === verdict)
        && words.every((word) => texts[i].includes(word));
      row.hidden = !kept;
      shown += kept;
    });
    control("count").textContent = `${shown} of ${rows.length} rows`;
  };
  for (const name of ["words", "theme", "verdict"]) control(name).addEventListener("input", show);
  show();
});
