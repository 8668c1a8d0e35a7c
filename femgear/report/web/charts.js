// Charts of the page: panels of curves, areas, bars and fields, drawn by plotly.js as they come into view.
"use strict";

const page = { data: null, dark: false };

page.read = async () => {
  const text = document.getElementById("data").textContent;
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return JSON.parse(await new Response(stream).text());
};

// in the dark greys change places, and colours too deep for its ground are mixed with white until they stand out
page.light = (parts) => {
  const [r, g, b] = parts.map((part) => (part <= 10 ? part / 3295 : ((part / 255 + 0.055) / 1.055) ** 2.4));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
};
page.colour = (colour) => {
  const found = /^#(..)(..)(..)$/.exec(colour || "");
  if (!page.dark || !found) return colour;
  const parts = found.slice(1).map((part) => parseInt(part, 16));
  if (Math.max(...parts) - Math.min(...parts) <= 12) {
    const level = Math.round(30 + 0.85 * (255 - parts[0]));
    return `rgb(${level},${level},${level})`;
  }
  const mixed = (share) => parts.map((part) => Math.round(part + share * (255 - part)));
  let share = 0;
  while (share < 0.8 && page.light(mixed(share)) < 0.25) share += 0.05;
  return `#${mixed(share).map((part) => part.toString(16).padStart(2, "0")).join("")}`;
};
page.style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
page.clear = (text) => text.replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/\n/g, "<br>");
page.wrapped = (text, pixels) => {
  const letters = Math.max(12, Math.floor(pixels / 6.6));
  const lines = text.split("\n").flatMap((line) => {
    const found = [""];
    for (const word of line.split(" ")) {
      const last = found.length - 1;
      if (found[last] && found[last].length + word.length >= letters) found.push(word);
      else found[last] += (found[last] ? " " : "") + word;
    }
    return found;
  });
  return { text: page.clear(lines.join("\n")), lines: lines.length };
};

page.trace = (one, panel, key, seen) => {
  const fade = (colour, share) => {
    const [r, g, b] = page.colour(colour).match(/^#/)
      ? page.colour(colour).slice(1).match(/../g).map((part) => parseInt(part, 16))
      : page.colour(colour).match(/\d+/g);
    return `rgba(${r},${g},${b},${share})`;
  };
  const trace = { type: "scatter", ...one, xaxis: key.x, yaxis: key.y, connectgaps: false };
  if (one.line) trace.line = { ...one.line, color: page.colour(one.line.color) };
  if (one.mode === "text") trace.textfont = { color: page.colour(one.line.color), size: 11 };
  if (one.marker) trace.marker = { ...one.marker, color: page.colour(one.marker.color) };
  // markers at the edge of a panel are whole
  if (one.mode === "markers") trace.cliponaxis = false;
  if (one.fill) { trace.fillcolor = fade(one.fillcolor, one.fillopacity); trace.line = { width: 0 }; trace.mode = "lines"; }
  if (one.type === "heatmap") {
    trace.colorbar = { title: { text: page.clear(one.text), side: "right" }, thickness: 14, len: key.height, y: key.middle };
    delete trace.text;
  }
  trace.showlegend = Boolean(one.name) && !seen.has(one.name);
  trace.legendgroup = one.name || undefined;
  if (one.name) seen.add(one.name);
  const what = (axis, letter) => `${page.clear(axis.title || letter)}: %{${letter}:.5g}`;
  if (!one.hoverinfo) trace.hovertemplate = `${one.name ? page.clear(one.name) + "<br>" : ""}${what(panel.x, "x")}<br>${what(panel.y, "y")}<extra></extra>`;
  return trace;
};

page.axis = (axis, share, other, narrow, pixels, side) => {
  const found = { domain: share, anchor: other, zeroline: false, gridcolor: page.style("--rule"), linecolor: page.style("--soft"),
    showline: true, ticks: "outside", tickcolor: page.style("--soft"), exponentformat: "power", automargin: true,
    title: { text: page.wrapped(axis.title || "", pixels).text, standoff: 8 }, type: axis.log ? "log" : "linear" };
  if (axis.range) found.range = axis.log ? axis.range.map(Math.log10) : axis.range;
  if (axis.ticks) Object.assign(found, { tickmode: "array", tickvals: axis.ticks, tickangle: axis.angle,
    ticktext: axis.texts.map((text) => page.clear(narrow && axis.angle ? text.split("\n")[0] : text)) });
  // a number needs a line of its own
  if (axis.log) found.dtick = axis.range ? Math.max(1, Math.ceil((18 * Math.log10(axis.range[1] / axis.range[0])) / side)) : 1;
  else found.tickformat = ",~r";
  if (axis.hidden) Object.assign(found, { visible: false });
  if (narrow) found.nticks = 5;
  return found;
};

// length of a word along an axis, of a slanted one its share [px]
page.along = (word, share) => 6.6 * Math.abs(share(word.angle * Math.PI / 180)) * Math.max(...word.text.split("\n").map((line) => line.length));

// room that slanted words at the upper end of the first panels need above it [px]
page.headroom = (chart) => Math.max(0, ...chart.panels.flatMap((panel) => panel.words.map((word) => {
  if (word.paper || word.above || !word.angle || !panel.y.range || panel.place[0] || word.align[1] !== "bottom") return 0;
  const at = panel.y.log ? Math.log10 : Number, [low, high] = panel.y.range.map(at);
  return page.along(word, Math.sin) + 14 - word.shift[1] - (Math.max(0, high - at(word.y)) / (high - low)) * 210;
})));

// room that upright names of ticks need below the panels [px]
page.footroom = (chart) => Math.max(0, ...chart.panels.map(({ x }) => (x.texts && x.angle && !x.hidden
  ? 6.6 * Math.max(...x.texts.flatMap((text) => text.split("\n")).map((line) => line.length)) : 0)));

// room that words at the right end of the panels need beyond it [px]
page.overhang = (chart, columns, width) => Math.max(20, ...chart.panels.flatMap((panel) => panel.words.map((word) => {
  if (word.paper || panel.x.hidden || !panel.x.range) return 0;
  const at = panel.x.log ? Math.log10 : Number, [low, high] = panel.x.range.map(at);
  const long = 14 * Math.abs(Math.sin(word.angle * Math.PI / 180)) + page.along(word, Math.cos);
  const beyond = { left: long, center: long / 2, right: 0 }[word.align[0]] + word.shift[0];
  return beyond - (Math.max(0, high - at(word.x)) / (high - low)) * (width / columns) + 6;
})));

page.arrange = (chart, width) => {
  const own = chart.panels.filter((panel) => panel.over === undefined);
  const single = width < 620 && chart.columns > 1, hidden = chart.panels.every((panel) => panel.x.hidden);
  const rows = single ? own.length : chart.rows, columns = single ? 1 : chart.columns;
  const left = 70, twin = own.length < chart.panels.length ? 78 : 0;
  const right = Math.max(page.overhang(chart, columns, width - 90), twin), across = hidden ? 10 : 78;
  // as much room above the panels as their titles need, and as that of all needs
  const pixels = (width - left - right + across) / columns - across;
  const lines = Math.max(1, ...chart.panels.map((panel) => page.wrapped(panel.title, pixels).lines));
  const title = chart.title ? page.wrapped(chart.title, 0.8 * width) : { text: "", lines: 0 };
  const foot = page.footroom(chart), lift = Math.max(...chart.panels.map(page.lift));
  const above = 20 + 16 * lines + lift + (title.lines && 10 + 20 * title.lines);
  const gaps = { x: across, y: hidden ? 14 + 16 * lines : (single ? 74 : 66) + 16 * lines + foot, left, right, top: Math.max(above, page.headroom(chart)), bottom: 62 + foot };
  const ratio = chart.size[1] / chart.size[0];
  const cell = chart.panels[0].square ? Math.min((width - 40) / columns, 460) * 1.02 : single ? 250 : Math.min(Math.max((width * ratio) / rows, chart.least || 210), 340);
  const height = rows * cell + gaps.top + gaps.bottom;
  const inner = { w: width - gaps.left - gaps.right, h: height - gaps.top - gaps.bottom };
  const places = chart.panels.map((panel, number) => {
    const i = own.indexOf(panel.over === undefined ? panel : chart.panels[panel.over]);
    const [r0, r1, c0, c1] = single ? [i, i + 1, 0, 1] : panel.place;
    const dx = gaps.x / inner.w, dy = gaps.y / inner.h;
    const wide = (1 + dx) / columns, high = (1 + dy) / rows;
    return { x: [c0 * wide, c1 * wide - dx], y: [1 - (r1 * high - dy), 1 - r0 * high] };
  });
  return { height, places, gaps, inner, title: title.text };
};

// range of an ordinate without the room that words have in a picture
page.closer = ({ y, traces }) => {
  const largest = Math.max(...traces.flatMap((one) => one.y || []).filter(Number.isFinite));
  return largest > y.range[0] ? [y.range[0], Math.min(y.range[1], y.range[0] + 1.08 * (largest - y.range[0]))] : y.range;
};

// room that words above a small panel need between it and its title [px]
page.lift = (panel) => Math.max(0, ...panel.words.map((word) => (word.above ? 10 + page.along(word, Math.sin) : 0)));

// one panel alone, for page one, with the title of the axis that it shares
page.chartOf = (div) => {
  const chart = page.data.charts[div.dataset.chart];
  if (div.dataset.panel === undefined) return chart;
  const number = Number(div.dataset.panel), panel = chart.panels[number], titles = chart.panels.map(({ x }) => x.title).filter(Boolean);
  const x = { ...panel.x, title: panel.x.title || titles[titles.length - 1] };
  // slanted words at the ends of lines lie flat, which takes less room above the panel; upright ones stand above it, where no curve
  // is, and names of curves are left to the legend
  const named = (word) => panel.traces.some(({ name }) => name && name.startsWith(word.text));
  const upright = (word) => !word.paper && Math.abs(word.angle) === 90;
  const words = panel.words.filter((word) => !named(word)).map((word) => (upright(word) ? { ...word, above: true }
    : !word.paper && word.angle % 90 ? { ...word, angle: 0, align: ["center", word.align[1]] } : word));
  const y = words.some(({ above }) => above) && !panel.y.log ? { ...panel.y, range: page.closer(panel) } : panel.y;
  return { ...chart, rows: 1, columns: 1, size: [8, div.closest(".many") ? 1.3 : div.closest(".both") || div.closest(".paper") ? 1.75 : 3.4], least: div.closest(".many") ? 90 : 110, title: "", panels: [{ ...panel, x, y, words, place: [0, 1, 0, 1], shared: 0 },
    ...chart.panels.filter(({ over }) => over === number).map((twin) => ({ ...twin, place: [0, 1, 0, 1], shared: 0, over: 0 }))] };
};

// the legend of a small chart has the largest curves, and tells how many more there are; returns its entries
page.shorten = (traces, count, most) => {
  if (count <= Math.max(most, 4)) return count;
  const size = ({ y }) => Math.max(...y.map((value) => (Number.isFinite(value) ? Math.abs(value) : 0)));
  const named = traces.filter((one) => one.showlegend).sort((a, b) => size(b) - size(a));
  named.slice(most - 1).forEach((one) => { one.showlegend = false; });
  const { xaxis, yaxis } = traces[0];
  traces.push({ x: [null], y: [null], xaxis, yaxis, mode: "lines", line: { color: "rgba(0,0,0,0)" }, name: `${count - most + 1} more${document.documentElement.classList.contains("paper") ? "" : ", which the pointer names"}` });
  return most;
};

page.draw = (div) => {
  const chart = page.chartOf(div), width = Math.max(div.clientWidth, 280);
  const { height, places, gaps, inner, title } = page.arrange(chart, width);
  const seen = new Set(), traces = [], notes = [], shapes = [], narrow = width < 620;
  const layout = { height, width, margin: { l: gaps.left, r: gaps.right, t: gaps.top, b: gaps.bottom }, paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)", font: { family: "system-ui, Segoe UI, DejaVu Sans, sans-serif", size: narrow ? 11 : 13, color: page.style("--ink") },
    hovermode: "closest", hoverlabel: { align: "left" }, modebar: { bgcolor: "rgba(0,0,0,0)", color: page.style("--soft"), activecolor: page.style("--ink") }, dragmode: narrow ? false : "zoom",
    legend: { orientation: "h", yref: "container", y: 0, yanchor: "bottom", x: 0, maxheight: 0.9 } };
  if (chart.title) layout.title = { text: title, x: 0.01, xref: "container", y: 1, yref: "container", yanchor: "top", pad: { t: 18 }, font: { size: 15 } };
  chart.panels.forEach((panel, i) => {
    const end = i ? String(i + 1) : "", key = { x: "x" + end, y: "y" + end };
    const under = panel.over === undefined ? null : panel.over ? String(panel.over + 1) : "";
    if (under !== null) key.x = "x" + under;
    const place = places[i], first = panel.shared ? String(panel.shared + 1) : "";
    // titles are as long as their axes and the gap beside them; letters of titles are larger than those of words
    const long = (ends, side, gap) => 0.85 * ((ends[1] - ends[0]) * side + 0.6 * gap);
    if (under === null) layout["xaxis" + end] = page.axis(panel.x, place.x, key.y, narrow, long(place.x, inner.w, gaps.x), (place.x[1] - place.x[0]) * inner.w);
    layout["yaxis" + end] = page.axis(panel.y, place.y, key.x, false, long(place.y, inner.h, gaps.y), (place.y[1] - place.y[0]) * inner.h);
    if (under !== null) {
      const colour = page.colour((panel.traces.find(({ line }) => line) || { line: {} }).line.color);
      Object.assign(layout["yaxis" + end], { overlaying: "y" + under, side: "right", tickmode: "auto", nticks: 6, showgrid: false, tickfont: { color: colour }, linecolor: colour, tickcolor: colour });
      layout["yaxis" + end].title.font = { color: colour };
    } else if (panel.shared !== i) layout["xaxis" + end].matches = "x" + first;
    if (panel.square) Object.assign(layout["yaxis" + end], { scaleanchor: key.x, constrain: "domain" });
    key.height = place.y[1] - place.y[0];
    key.middle = (place.y[0] + place.y[1]) / 2;
    panel.traces.forEach((one) => traces.push(page.trace(one, panel, key, seen)));
    if (panel.title) {
      const pixels = (place.x[1] - place.x[0]) * inner.w;
      notes.push({ text: page.wrapped(panel.title, pixels).text, xref: "paper", yref: "paper", x: place.x[0], y: place.y[1],
        xanchor: "left", yanchor: "bottom", yshift: page.lift(panel), showarrow: false, align: "left", font: { size: narrow ? 11 : 12.5 } });
    }
    const kept = []; // words of a small chart that leave room for one another: [left, right, low, high] of each [px]
    panel.words.forEach((word) => {
      if (chart.least && !word.paper && panel.x.range && panel.y.range) {
        const along = (value, axis, side) => { const at = axis.log ? Math.log10 : Number, [low, high] = axis.range.map(at);
          return ((at(value) - low) / (high - low)) * side; };
        const across = along(word.x, panel.x, inner.w) + word.shift[0], up = along(word.y, panel.y, inner.h) - word.shift[1];
        const [wide, tall] = word.angle ? [14, 6.4 * word.text.length] : [6.4 * word.text.length, 14];
        const begin = across - { left: 0, center: 0.5, right: 1 }[word.align[0]] * wide;
        const low = word.above ? inner.h : up - { bottom: 0, baseline: 0, center: 0.5, top: 1 }[word.align[1]] * tall;
        const box = [begin, begin + wide, low, low + tall];
        if (box[1] > inner.w + gaps.right) return;
        if (kept.some((other) => box[0] < other[1] && other[0] < box[1] && box[2] < other[3] && other[2] < box[3])) return;
        kept.push(box);
      }
      const align = { center: "center", left: "left", right: "right" }, high = { bottom: "bottom", top: "top", center: "middle", baseline: "bottom" };
      const own = word.paper ? { xref: key.x + " domain", yref: key.y + " domain" } : { xref: key.x, yref: key.y };
      const at = (value, axis) => (axis.log && !word.paper ? Math.log10(value) : value);
      if (word.above) {
        const x = at(word.x, panel.x), frame = { xref: key.x, yref: "paper", x0: x, x1: x, opacity: 0.5, line: { color: page.style("--soft"), width: 1 } };
        shapes.push({ type: "line", layer: "below", ...frame, y0: place.y[0], y1: place.y[1] });
        notes.push({ text: page.clear(word.text), xref: key.x, yref: "paper", x, y: place.y[1], yshift: 3, showarrow: false, textangle: word.angle,
          xanchor: "center", yanchor: "bottom", font: { size: 11, color: page.colour(word.color) } });
        return;
      }
      notes.push({ text: page.clear(word.text), ...own, x: at(word.x, panel.x), y: at(word.y, panel.y), showarrow: false, textangle: word.angle,
        xanchor: align[word.align[0]], yanchor: high[word.align[1]] || "middle", xshift: word.shift[0], yshift: -word.shift[1],
        font: { size: 11, color: page.colour(word.color) }, bgcolor: word.ground ? page.style("--paper") : undefined });
    });
  });
  layout.annotations = notes;
  layout.shapes = shapes;
  layout.showlegend = seen.size > 1;
  // room for the lines of a legend beyond the first, before the panels of a small or narrow chart are squeezed to nothing
  const longest = Math.max(0, ...[...seen].map((name) => name.length)), each = Math.max(1, Math.floor((width - 90) / (45 + 6.2 * longest)));
  const listed = chart.least ? page.shorten(traces, seen.size, Math.max(3, 2 * each)) : seen.size;
  const more = layout.showlegend && (chart.least || narrow) ? 19 * (Math.ceil(listed / each) - 1) : 0;
  layout.height = height + more;
  layout.margin.b = gaps.bottom + more;
  Plotly.react(div, traces, layout, { displaylogo: false, responsive: false, displayModeBar: "hover",
    modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"] });
  // a legend of several lines makes the picture higher, not the panels lower
  const legend = layout.showlegend ? div._fullLayout.legend._height - 34 : 0;
  if (legend > more) Plotly.relayout(div, { height: height + legend, "margin.b": gaps.bottom + legend });
  div.style.minHeight = "";
  div.dataset.drawn = String(width);
};

page.drawAll = () => document.querySelectorAll(".chart").forEach(page.draw);

page.start = async () => {
  page.data = await page.read();
  const dark = matchMedia("(prefers-color-scheme: dark)");
  page.dark = dark.matches;
  const watcher = new IntersectionObserver((entries) => entries.forEach((entry) => {
    if (entry.isIntersecting && !entry.target.dataset.drawn) page.draw(entry.target);
  }), { rootMargin: "600px" });
  const resized = new ResizeObserver((entries) => entries.forEach(({ target }) => {
    if (target.dataset.drawn && Math.abs(target.clientWidth - Number(target.dataset.drawn)) > 4) page.draw(target);
  }));
  document.querySelectorAll(".chart").forEach((div) => {
    div.style.minHeight = page.arrange(page.chartOf(div), Math.max(div.clientWidth, 280)).height + "px";
    watcher.observe(div);
    resized.observe(div);
  });
  // what a link leads to is opened
  const unfold = () => { const target = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    for (let one = target; one; one = one.parentElement) if (one.tagName === "DETAILS") one.open = true;
    if (target) target.scrollIntoView(); };
  addEventListener("hashchange", unfold);
  unfold();
  const redraw = () => document.querySelectorAll(".chart[data-drawn]").forEach(page.draw);
  dark.addEventListener("change", () => { page.dark = dark.matches; redraw(); });
  // paper is white, and shows all charts
  addEventListener("beforeprint", () => { document.documentElement.classList.add("paper"); page.dark = false;
    document.querySelectorAll("details").forEach((one) => { one.dataset.open = one.open; one.open = true; });
    page.drawAll(); });
  addEventListener("afterprint", () => { document.documentElement.classList.remove("paper"); page.dark = dark.matches;
    document.querySelectorAll("details").forEach((one) => { one.open = one.dataset.open === "true"; });
    redraw(); });
  // charts in view come before what is in space
  for (const part of page.parts) {
    await later.seen();
    part();
  }
  document.documentElement.dataset.ready = "yes";
};
page.parts = [];
