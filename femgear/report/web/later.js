// Words, tables and cards are seen at once: what draws is compiled once they are, a script at a time.
"use strict";

const later = {};
// one picture of the window later; a window that nobody sees has none
later.seen = () => new Promise((go) => {
  requestAnimationFrame(() => setTimeout(go));
  setTimeout(go, 500);
});
// the first picture of words; a window that nobody sees, or that does not tell, waits no longer than this
later.painted = () => new Promise((go) => {
  if ((PerformanceObserver.supportedEntryTypes || []).includes("paint")) new PerformanceObserver(go).observe({ type: "paint", buffered: true });
  setTimeout(go, document.hidden ? 0 : 1000);
});
later.start = async () => {
  await later.painted();
  for (const text of document.querySelectorAll("script.later")) {
    const script = document.createElement("script");
    script.textContent = text.textContent;
    text.replaceWith(script);
    await new Promise((go) => setTimeout(go));
  }
  page.start();
};
addEventListener("DOMContentLoaded", later.start);
