// Says what happened and what to do where the server of this window has ended: it cannot be asked any more.
(() => {
  const { command } = document.currentScript.dataset;
  const patience = 1500; // a connection that is back as soon as this [ms] is no end
  let dialog = null;

  const line = (name, text) => Object.assign(document.createElement(name), { textContent: text });

  const tell = () => {
    if (dialog) return;
    dialog = document.createElement("dialog");
    dialog.className = "ended";
    const title = Object.assign(line("h2", "The app has ended"), { id: "ended" });
    const steps = document.createElement("ol");
    const start = line("li", "Start it again, in a terminal: ");
    start.append(line("code", command));
    steps.append(start, line("li", "Open the address that it prints then: it holds a new key. Your changes are there."));
    dialog.append(
      title,
      line("p", "Nothing is lost: what you changed and did not save is kept beside the case file."),
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
    window.socket.on("disconnect", () => setTimeout(() => window.socket.connected || tell(), patience));
    window.socket.on("connect", () => {
      dialog?.remove();
      dialog = null;
    });
  };
  watch();
})();
