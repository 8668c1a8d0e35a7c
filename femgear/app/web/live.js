// Answers of the app: cards, gears in space and charts of the case as it stands, which the window sends.
"use strict";

const live = { names: [], gears: document.getElementById("gears"), part: "" };
live.at = (id) => document.getElementById(id);
live.make = (tag, name, text) => {
  const made = document.createElement(tag);
  if (name) made.className = name;
  if (text) made.textContent = text;
  return made;
};

// everything that is shown belongs to a former text until its stage has answered again
live.begin = ({ text, since }) => {
  document.body.classList.remove("refused");
  document.querySelectorAll("#seen > figure").forEach((figure) => figure.classList.add("former"));
  live.at("cards").classList.add("former");
  live.drafted = "";
  live.at("state").textContent = text || "computing";
  const start = performance.now() - 1000 * (since || 0);
  clearInterval(live.clock);
  live.clock = setInterval(() => {
    live.at("elapsed").textContent = `${Math.round((performance.now() - start) / 1000)} s so far`;
  }, 1000);
};
live.step = ({ text }) => { live.at("state").textContent = live.drafted ? `${live.drafted}; ${text}` : text; };
live.draft = ({ positions }) => {
  live.at("state").textContent = live.drafted = `draft while a slider moves: ${positions} positions, peaks between them are cut off`;
};
live.end = ({ seconds, text }) => {
  clearInterval(live.clock);
  live.at("elapsed").textContent = "";
  live.drafted = "";
  live.at("state").textContent = text || `computed in ${seconds.toFixed(2)} s`;
  if (!text) live.at("cards").classList.remove("former");
  document.body.classList.toggle("refused", Boolean(text));
};

live.judge = ({ duty, sentence, judgements }) => {
  live.at("duty").textContent = duty;
  live.at("sentence").textContent = sentence;
  const cards = judgements.map((one) => {
    const card = live.make("li", `card ${one.state}`), question = live.make("p", "question", `${one.question} `);
    question.append(live.make("b", "", one.words));
    card.append(question, live.make("p", "answer", one.answer));
    if (one.limit) card.append(live.make("p", "limit", one.limit));
    return card;
  });
  live.at("cards").replaceChildren(...cards);
};

live.draw = ({ stage, charts, captions }) => {
  Object.entries(charts).forEach(([name, chart]) => {
    page.data.charts[name] = chart.png ? { panels: [] } : chart;
    let figure = live.at("seen").querySelector(`[data-name="${CSS.escape(name)}"]`);
    if (!figure) {
      figure = live.make("figure");
      figure.dataset.name = name;
      const place = live.make("div", "chart");
      place.dataset.chart = name;
      place.setAttribute("role", "group");
      place.setAttribute("aria-label", name.replaceAll("_", " "));
      const words = live.make("details");
      words.append(live.make("summary", "", name.replaceAll("_", " ")), live.make("figcaption", "", captions[name]));
      figure.append(place, words);
      live.at("seen").append(figure);
    }
    figure.dataset.stage = stage;
    figure.classList.remove("former");
    const place = figure.querySelector(".chart");
    if (chart.png) {
      const picture = live.make("img");
      picture.alt = captions[name];
      picture.src = `data:image/png;base64,${chart.png}`;
      place.replaceChildren(picture);
    } else page.draw(place);
    live.arrange();
  });
};
live.fresh = ({ stage }) => document.querySelectorAll("#seen > figure").forEach((figure) => {
  if (figure.dataset.stage === stage) figure.classList.remove("former");
});
// charts stand in the order in which they were chosen
live.place = (figure) => live.names.findIndex((name) => figure.dataset.name === name || figure.dataset.name.startsWith(`${name}_`));
live.arrange = () => document.querySelectorAll("#seen > figure").forEach((figure) => { figure.style.order = live.place(figure); });
live.keep = ({ names }) => {
  live.names = names;
  document.querySelectorAll("#seen > figure").forEach((figure) => {
    if (live.place(figure) >= 0) return;
    Plotly.purge(figure.querySelector(".chart"));
    figure.remove();
  });
  live.arrange();
};

// gears are drawn anew where teeth or places changed, seen from where the eye was
live.space = ({ model }) => {
  const former = live.at("solid-place"), seen = former && former.space ? former.space.view : null;
  const bodies = model ? model.bodies.map(({ name }) => name).join() : "", same = bodies === live.bodies;
  live.bodies = bodies;
  const chosen = same && seen ? { view: live.at("solid-view").value, moving: former.space.state.moving } : null;
  const eye = same && seen ? [seen.camera.position.clone(), seen.orbit.target.clone()] : null;
  if (former && former.space) { former.space.state.moving = false; seen.dispose(); }
  live.gears.hidden = !model;
  live.gears.innerHTML = model ? live.part : "";
  page.data.space = model;
  page.space();
  const place = live.at("solid-place");
  if (!place || !place.space) return;
  const { view } = place.space, chooser = live.at("solid-view");
  if (eye) { view.camera.position.copy(eye[0]); view.orbit.target.copy(eye[1]); view.orbit.update(); }
  chooser.value = chosen ? chosen.view : [...chooser.options].some(({ value }) => value === "turning") ? "turning" : "0";
  chooser.dispatchEvent(new Event("change"));
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  if (chosen ? chosen.moving : chooser.value === "turning" && !still) live.at("solid-play").click();
  view.render();
};

live.table = ({ title, header, rows, notes }) => {
  const table = live.make("table"), caption = live.make("caption", "", title), body = live.make("tbody");
  const row = (cells, tag) => { const line = live.make("tr"); line.append(...cells.map((text) => live.make(tag, "", text))); return line; };
  table.append(caption);
  if (header.length) { const head = live.make("thead"); head.append(row(header, "th")); table.append(head); }
  body.append(...rows.map((cells) => row(cells, "td")));
  table.append(body);
  const wide = live.make("div", "wide");
  wide.tabIndex = 0;
  wide.append(table);
  return [wide, ...notes.map((text) => live.make("p", "note", text))];
};
live.tables = ({ blocks }) => {
  live.at("numbers").hidden = !blocks.length;
  live.at("tables").replaceChildren(...blocks.flatMap(live.table));
};
live.clear = () => {
  live.judge({ duty: "", sentence: "", judgements: [] });
  live.keep({ names: [] });
  live.space({ model: null });
  live.tables({ blocks: [] });
};

page.parts.push(() => {
  live.part = live.at("part").innerHTML;
  addEventListener("message", (event) => {
    if (event.source !== parent || event.origin !== location.origin) return;
    const { what, ...given } = event.data;
    if (["begin", "step", "draft", "end", "judge", "draw", "fresh", "keep", "space", "tables", "clear"].includes(what)) live[what](given);
  });
  parent.postMessage({ femgear: "ready" }, location.origin);
});
