// Takes no text that is too long for the connection, and says what happened and what to do where the server of this
// window has ended: it cannot be asked any more.
(() => {
  const { command, longest } = document.currentScript.dataset;
  const patience = 1500; // a connection that is back as soon as this [ms] is no end
  const sent = 1000; // what was typed so long before the end [ms] may not have come to the server
  const typed = new Map(); // text and time of what was typed last, by its label
  let dialog = null;
  let gone = 0;

  const KEPT = "Nothing is lost: what you changed and did not save is kept beside the case file.";
  const PERHAPS = "What you changed and did not save is kept beside the case file. What you typed last may be missing there.";

  const line = (name, text) => Object.assign(document.createElement(name), { textContent: text });

  const refuse = (event) => {
    const given = (event.clipboardData || event.dataTransfer)?.getData("text") || event.data;
    if (!given || given.length <= Number(longest)) return;
    event.preventDefault();
    event.stopPropagation();
    emitEvent("femgear-too-long", { length: given.length, key: event.target.dataset?.key || "" });
  };
  ["paste", "drop", "beforeinput"].forEach((name) => addEventListener(name, refuse, true));

  addEventListener("input", ({ target }) => {
    const text = "value" in target ? target.value : getSelection().anchorNode?.parentElement?.closest(".cm-line")?.textContent;
    const label = target.getAttribute("aria-label") || "the text";
    typed.set(target.dataset?.key || label, { text, time: Date.now() });
  }, true);

  const late = () => [...typed].filter(([, { text, time }]) => text && time > gone - sent);

  const tell = () => {
    if (dialog) return;
    const last = late();
    dialog = document.createElement("dialog");
    dialog.className = "ended";
    const title = Object.assign(line("h2", "The app has ended"), { id: "ended" });
    const steps = document.createElement("ol");
    const start = line("li", "Start it again, in a terminal: ");
    start.append(line("code", command));
    steps.append(start, line("li", "Open the address that it prints then: it holds a new key. Your changes are there."));
    dialog.append(
      title,
      line("p", last.length ? PERHAPS : KEPT),
      ...last.map(([name, { text }]) => line("p", `Typed last, so look whether it is there: ${name}: ${text}`)),
      steps,
      line("p", "This window can be closed."),
    );
    dialog.setAttribute("aria-labelledby", "ended");
    dialog.addEventListener("cancel", (event) => event.preventDefault());
    document.body.append(dialog);
    dialog.showModal();
  };

  const watch = () => {
    if (!window.socket) {
      setTimeout(watch, 100);
      return;
    }
    window.socket.on("disconnect", () => {
      gone = Date.now();
      setTimeout(() => window.socket.connected || tell(), patience);
    });
    window.socket.on("connect", () => {
      dialog?.remove();
      dialog = null;
    });
  };
  watch();
})();
