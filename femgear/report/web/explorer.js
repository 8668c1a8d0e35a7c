// A run-up to walk through: modes and mesh orders, level, spectrum, lobes and sound at one speed.
"use strict";

// amplitude of the A-weighting at a frequency over that at 1 kHz (IEC 61672-1)
page.aWeight = (hertz) => {
  const f = hertz * hertz, way = (g) => (12194 ** 2 * g * g) / ((g + 20.6 ** 2) * Math.sqrt((g + 107.7 ** 2) * (g + 737.9 ** 2)) * (g + 12194 ** 2));
  return way(f) / way(1e6);
};

page.explorer = (root) => {
  const data = page.data[root.dataset.run], part = (name) => root.querySelector(`[data-part="${name}"]`);
  const count = data.order.length, unpack = ({ unit, values }) => {
    const bytes = Uint8Array.from(atob(values), (letter) => letter.charCodeAt(0)), whole = new Int16Array(bytes.buffer);
    return Float32Array.from(whole, (value, i) => value * unit[(i >> 1) % count]);
  };
  const lines = Object.fromEntries(Object.entries(data.lines).map(([name, packed]) => [name, unpack(packed)]));
  // levels: unit, quantity, reference of decibels, times the acceleration is integrated, units a SI unit
  const forms = [["m/s²", "acceleration", 0, 0, 1], ["g", "acceleration", 0, 0, 1 / 9.80665], ["mm/s", "velocity", 0, 1, 1e3],
    ["µm", "displacement", 0, 2, 1e6], ["dB re 1e-6 m/s²", "acceleration level", 1e-6, 0, 1]]
    .flatMap((one) => (one[2] ? [false] : [false, true]).map((peak) => [...one, peak]));
  const chosen = () => {
    const [unit, quantity, reference, integrated, scale, peak] = forms[Number(part("form").value)];
    if (source.value === "acceleration") return { unit, quantity, reference, integrated, scale, peak };
    return reference ? { unit: "dB re 20 µPa", quantity: "sound pressure level", reference: 20e-6, integrated: 0, scale: 1, peak }
      : { unit: "Pa", quantity: "sound pressure", reference: 0, integrated: 0, scale: 1, peak };
  };
  const detector = (sum) => (chosen().peak ? (sum ? "peak = √2 r.m.s." : "peak") : "r.m.s.");
  const filtered = () => (weighted.checked ? ", A-weighted" : "") + (Number.isFinite(Number(band.value)) ? `, to ${Number(band.value) / 1000} kHz` : "");
  const words = (sum) => `${chosen().quantity}, ${detector(sum)}${filtered()} [${chosen().unit}]`;
  // the value shown of a line, and of the sum of the powers of several
  const shownOf = (found) => {
    const { reference, integrated, scale, peak } = chosen();
    const square = found.reduce((sum, one) => (one.hertz > 0 ? sum + 0.5 * (one.size / (2 * Math.PI * one.hertz) ** integrated) ** 2 : sum), 0);
    return reference ? 20 * Math.log10(Math.sqrt(square) / reference) : Math.sqrt(square * (peak ? 2 : 1)) * scale;
  };
  const told = (value) => `${Number.isFinite(value) ? value.toPrecision(4) : "0"} ${chosen().unit}${weighted.checked ? ", A-weighted" : ""}`;
  forms.forEach((_, i) => part("form").add(new Option("", String(i))));
  const slider = part("speed"), shown = part("value"), source = part("source"), play = part("play"), volume = part("volume"), band = part("band"), weighted = part("weighted");
  slider.max = data.speed.length - 1;
  const highest = Math.max(...data.order) * Math.max(...data.carrier);
  band.add(new Option("all frequencies", "Infinity"));
  [5, 10, 20].filter((one) => 1000 * one < highest).forEach((one) => band.add(new Option(`to ${one} kHz`, String(1000 * one))));
  Object.keys(lines).forEach((name) => source.add(new Option({ acceleration: "accelerometer", pressure: "microphone" }[name], name)));
  if (lines.pressure) source.value = "pressure";
  // runs of former versions do not tell
  const short = (i) => Boolean(data.short && data.short[i]);
  let index = data.level.indexOf(Math.max(...data.level));
  slider.value = index;

  // amplitudes and phases of a speed
  const at = (i, name) => data.order.map((order, k) => {
    const re = lines[name][2 * (i * count + k)], im = lines[name][2 * (i * count + k) + 1];
    return { order, re, im, size: Math.hypot(re, im), hertz: order * data.carrier[i] };
  });
  // what levels are made of: lines of the band, weighted as asked for
  const hear = (i, name) => {
    const top = Number(band.value);
    return at(i, name).map((one) => {
      const share = one.hertz > top ? 0 : weighted.checked ? page.aWeight(one.hertz) : 1;
      return { ...one, re: one.re * share, im: one.im * share, size: one.size * share };
    });
  };
  const look = (title, foot = 50) => {
    const heading = page.wrapped(title, part("level").clientWidth - 76);
    return { paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", margin: { l: 62, r: 14, t: 22 + 16 * heading.lines, b: foot }, height: 330, width: part("level").clientWidth,
      font: { family: "system-ui, Segoe UI, DejaVu Sans, sans-serif", size: 12, color: page.style("--ink") }, showlegend: false, hovermode: "closest",
      title: { text: heading.text, x: 0, xref: "paper", y: 1, yref: "container", yanchor: "top", pad: { t: 2 + 8 * heading.lines }, font: { size: 13 } } };
  };
  const axis = (title, more) => ({ title: { text: title }, gridcolor: page.style("--rule"), linecolor: page.style("--soft"), showline: true, zeroline: false,
    exponentformat: "power", automargin: true, ...(more.type === "log" ? { dtick: 1 } : { tickformat: ",~r" }), ...more });
  const quiet = { displaylogo: false, responsive: false, displayModeBar: false };
  const top = Math.max(...data.mesh) * (data.harmonics + 0.5), speeds = [data.speed[0], data.speed[data.speed.length - 1]];

  const below = { showlegend: true, height: 390, legend: { orientation: "h", yref: "container", y: 0, yanchor: "bottom" } };
  const campbell = () => {
    const first = new Set();
    const traces = data.modes.map(([number, hertz, kind, colour]) => {
      const showlegend = !first.has(kind);
      first.add(kind);
      return { x: speeds, y: [hertz, hertz], mode: "lines", name: page.clear(kind), legendgroup: kind, showlegend,
        line: { color: page.colour(colour), width: 1.4, dash: kind.startsWith("ring, ") ? "dash" : "solid" },
        hovertemplate: `mode ${number}: ${hertz.toFixed(1)} Hz<br>${page.clear(kind)}<extra></extra>` };
    });
    for (let h = 1; h <= data.harmonics; h++) {
      traces.push({ x: data.speed, y: data.mesh.map((one) => h * one), mode: "lines", name: "mesh harmonics", legendgroup: "mesh harmonics", showlegend: h === 1,
        line: { color: page.colour("#808080"), width: 1, dash: "dot" }, hovertemplate: `mesh harmonic ${h}<br>%{x:.5g} rpm, %{y:.5g} Hz<extra></extra>` });
    }
    // circles have areas over the least one in proportion to the level by that mode at that harmonic alone
    const met = data.resonances.filter((one) => one[4] <= data.harmonics), loudest = Math.max(...met.map((one) => one[5] || 0), 1e-300);
    traces.push({ x: met.map((one) => one[0]), y: met.map((one) => one[1]), mode: "markers", showlegend: false, name: "resonances",
      marker: { symbol: "circle-open", size: met.map((one) => Math.sqrt(20 + (300 * (one[5] || 0)) / loudest)), color: page.colour("#d55e00"), line: { width: 2 } },
      text: met.map(([rpm, hertz, mode, kind, h, alone]) => `${rpm.toFixed(1)} rpm: mode ${mode} (${page.clear(kind)})<br>${hertz.toFixed(1)} Hz, mesh harmonic ${h}`
        + (alone === undefined ? "" : `<br>alone ${alone.toPrecision(3)} m/s² r.m.s.`)),
      hovertemplate: "%{text}<extra></extra>" });
    traces.push({ x: [], y: [], mode: "markers", showlegend: false, marker: { size: 8, color: page.colour("#d55e00") }, hoverinfo: "skip" });
    Plotly.react(part("campbell"), traces, { ...look("Modes, mesh orders and their resonances (circles, larger for a higher level of that mode alone)", 110), ...below,
      xaxis: axis("speed [rpm]", { range: speeds }), yaxis: axis("frequency [Hz]", { range: [0, top] }) }, quiet);
  };
  // an axis of levels with its lower end, some decades or the same in decibels below the largest value
  const scaled = (largest, decades, sum) => chosen().reference
    ? { low: largest - 20 * decades, axis: axis(lined(words(sum)), { range: [largest - 20 * decades, largest + 6] }) }
    : { low: largest * 10 ** -decades, axis: axis(lined(words(sum)), { type: "log", range: [Math.log10(largest) - decades, Math.log10(largest) + 0.3] }) };
  const lined = (text) => text.replace(" [", "<br>[");
  const finite = (values) => values.filter(Number.isFinite).reduce((a, b) => Math.max(a, b), -1e30);
  // the limit of the whole acceleration in the unit chosen
  const limited = () => {
    const { integrated, reference, scale, peak } = chosen();
    if (!data.limit || integrated || source.value !== "acceleration" || filtered()) return null;
    return data.limit.map((one) => (reference ? 20 * Math.log10(one / reference) : one * scale * (peak ? Math.SQRT2 : 1)));
  };
  const levels = () => {
    const values = data.speed.map((_, i) => shownOf(hear(i, source.value)));
    const { reference } = chosen(), end = finite(values), least = Math.min(...values.filter((value) => Number.isFinite(value) && (reference || value > 0)));
    const deep = reference ? (end - least) / 20 : Math.log10(end / least);
    // dotted where the excitation ends short, which joins what is on either side
    const curve = (dotted) => ({ x: data.speed, y: values.map((value, i) => (short(i) === dotted || (dotted && (short(i - 1) || short(i + 1))) ? value : null)), mode: "lines",
      line: { color: page.colour("#0072b2"), width: 1.8, dash: dotted ? "dot" : "solid" }, hovertemplate: `%{x:.5g} rpm: %{y:.4g}${dotted ? "<br>the excitation ends short" : ""}<extra></extra>` });
    const doubtful = data.speed.some((_, i) => short(i));
    const traces = doubtful ? [curve(false), curve(true)] : [curve(false)], limit = limited();
    if (limit) traces.push({ x: data.speed, y: limit, mode: "lines", line: { color: page.colour("#d55e00"), width: 1.6, dash: "dash" }, hovertemplate: "%{x:.5g} rpm: limit %{y:.4g}<extra></extra>" });
    Plotly.react(part("level"), traces,
      { ...look(`Level over the speed${limit ? "; dashed: limit" : ""}${doubtful ? "; dotted: the excitation ends short (W-EXCITATION)" : ""}`), xaxis: axis("speed [rpm]", { range: speeds }), yaxis: scaled(end, deep + 0.2, true).axis }, quiet);
  };
  const spectrum = () => {
    const found = hear(index, source.value), x = [], y = [], values = found.map((one) => shownOf([one])), { low, axis: upright } = scaled(finite(values), 4, false);
    found.forEach((one, k) => { x.push(one.hertz, one.hertz, null); y.push(low, Math.max(values[k], low), null); });
    const tips = found.map((one, k) => `order ${one.order}, ${one.hertz.toFixed(1)} Hz<br>${told(values[k])}`);
    const loud = found.filter((_, k) => values[k] > low);
    Plotly.react(part("spectrum"), [{ x, y, mode: "lines", line: { color: page.colour("#0072b2"), width: 1.4 }, hoverinfo: "skip" },
      { x: found.map((one) => one.hertz), y: values.map((one) => Math.max(one, low)), mode: "markers", marker: { size: 4, color: page.colour("#0072b2") }, text: tips, hovertemplate: "%{text}<extra></extra>" }],
      { ...look("Lines at this speed"), xaxis: axis("frequency [Hz]", { range: [0, Math.max(...loud.map((one) => one.hertz)) * 1.03] }), yaxis: upright }, quiet);
  };
  // the orders asked for, else the strongest ones around the strongest mesh harmonics, over the speed
  const cuts = () => {
    const all = data.speed.map((_, i) => hear(i, source.value)), peak = data.order.map((_, k) => finite(all.map((one) => shownOf([one[k]])))), strongest = new Map();
    data.order.map((_, k) => k).sort((a, b) => peak[b] - peak[a]).forEach((k) => {
      const h = Math.round(data.order[k] / data.teeth);
      if (h > 0 && strongest.size < 6 && !strongest.has(h)) strongest.set(h, k);
    });
    const wanted = part("orders").value.split(/[\s,;]+/).filter(Boolean).map(Number);
    const place = (order) => data.order.findIndex((one) => Math.abs(one - order) < 0.005);
    const lacking = wanted.filter((order) => place(order) < 0), asked = wanted.map(place).filter((k) => k >= 0).slice(0, 6);
    const drawn = (asked.length ? asked : [...strongest.values()]).sort((a, b) => data.order[a] - data.order[b]);
    const colours = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];
    const traces = drawn.map((k, i) => {
      const order = data.order[k], h = Math.round(order / data.teeth), beside = Number((order - h * data.teeth).toPrecision(6));
      const name = h ? `${order} = ${h}·${data.teeth}${beside ? (beside > 0 ? " + " : " − ") + Math.abs(beside) : ""}` : String(order);
      return { x: data.speed, y: all.map((one) => shownOf([one[k]])), name, mode: "lines", line: { color: page.colour(colours[i]), width: 1.6 }, hovertemplate: `order ${name}<br>%{x:.5g} rpm: %{y:.4g}<extra></extra>` };
    });
    const title = lacking.length ? `Order cuts; not among the ${count} largest: ${page.clear(lacking.slice(0, 6).join(", "))}` : "Order cuts";
    Plotly.react(part("cuts"), traces, { ...look(title, 110), ...below,
      xaxis: axis("speed [rpm]", { range: speeds }), yaxis: scaled(finite(drawn.map((k) => peak[k])), 4, false).axis }, quiet);
  };
  const waterfall = () => {
    const columns = 300, end = Math.max(...data.mesh) * (data.harmonics + 0.5), { reference, unit } = chosen();
    const rows = data.speed.map((_, i) => {
      const found = Array.from({ length: columns }, () => []);
      hear(i, source.value).forEach((one) => { if (one.hertz < end) found[Math.floor((one.hertz / end) * columns)].push(one); });
      return found.map((some) => (reference ? shownOf(some) : Math.log10(shownOf(some))));
    });
    const top = finite(rows.map(finite)), deep = reference ? 80 : 4, z = rows.map((row) => row.map((one) => Math.max(one, top - deep)));
    const steps = Array.from({ length: 5 }, (_, i) => Math.floor(top) - i), ticks = reference ? {} : { tickvals: steps, ticktext: steps.map((one) => `10<sup>${one}</sup>`) };
    Plotly.react(part("waterfall"), [{ type: "heatmap", x0: end / columns / 2, dx: end / columns, y: data.speed, z, zmin: top - deep, zmax: top, colorscale: "Cividis",
      text: reference ? undefined : z.map((row) => row.map((one) => (10 ** one).toPrecision(3))),
      hovertemplate: `%{x:.5g} Hz, %{y:.5g} rpm<br>%{${reference ? "z:.4g" : "text"}} ${unit}<extra></extra>`,
      colorbar: { title: { text: lined(words(true)), side: "right" }, thickness: 12, ...ticks } }],
      { ...look("Waterfall"), xaxis: axis("frequency [Hz]", {}), yaxis: axis("speed [rpm]", {}) }, quiet);
  };
  // the level among the charts below follows: its points have the ratio of this form to acceleration, r.m.s.
  const follow = () => {
    const chart = root.dataset.run === "runup" && page.data.charts.run_up_levels, panel = chart && chart.panels[0];
    if (!panel || !/\[m\/s²\]$/.test((chart.plain ||= structuredClone(panel)).y.title)) return;
    const before = source.value, { plain } = chart;
    source.value = "acceleration";
    const plainly = (i) => Math.sqrt(at(i, "acceleration").reduce((sum, one) => sum + 0.5 * one.size ** 2, 0));
    const { reference, unit } = chosen(), ratio = data.speed.map((_, i) => (reference ? 1 / reference : shownOf(at(i, "acceleration")) / plainly(i)));
    const value = (x, y) => {
      const j = Math.max(data.speed.findIndex((one) => one >= Math.min(x, speeds[1])), 1), a = data.speed[j - 1], b = data.speed[j];
      const share = Math.min(Math.max((x - a) / (b - a), 0), 1), found = y * (ratio[j - 1] * (1 - share) + ratio[j] * share);
      return y === null ? null : reference ? 20 * Math.log10(Math.max(found, 1e-12)) : found;
    };
    panel.traces = plain.traces.map((trace) => ({ ...trace, y: trace.y.map((y, i) => value(trace.x ? trace.x[i] : trace.x0 + i * trace.dx, y)) }));
    panel.words = plain.words.map((word) => (word.paper ? word : { ...word, y: value(word.x, word.y) }));
    const all = panel.traces.flatMap((trace) => trace.y), end = finite(all);
    panel.y = { ...plain.y, title: words(true), range: reference ? [Math.min(...all.filter(Number.isFinite)) - 3, end + 20] : [0, 1.45 * end] };
    source.value = before;
    document.querySelectorAll('.chart[data-chart="run_up_levels"][data-drawn]').forEach(page.draw);
  };
  const lobes = () => {
    const { reference, integrated, scale, peak } = chosen(), to = (one) => (reference ? 1 : scale * (peak ? 1 : Math.SQRT1_2)) / (one.hertz > 0 ? (2 * Math.PI * one.hertz) ** integrated : 1);
    const value = (r) => told(reference ? 20 * Math.log10((r * Math.SQRT1_2) / reference) : r);
    const found = hear(index, source.value).map((one) => ({ ...one, re: one.re * to(one), im: one.im * to(one), size: one.size * to(one) })), bands = new Map();
    found.forEach((one) => { const h = Math.round(one.order / data.teeth); bands.set(h, Math.max(bands.get(h) || 0, one.size)); });
    const harmonic = [...bands].sort((a, b) => b[1] - a[1])[0][0], own = found.filter((one) => Math.round(one.order / data.teeth) === harmonic);
    const angle = Array.from({ length: 361 }, (_, i) => (2 * Math.PI * i) / 360);
    const envelope = angle.map((a) => {
      let re = 0, im = 0;
      own.forEach((one) => { const c = Math.cos((one.order - harmonic * data.teeth) * a), s = Math.sin((one.order - harmonic * data.teeth) * a); re += one.re * c - one.im * s; im += one.re * s + one.im * c; });
      return Math.hypot(re, im);
    });
    const reach = 1.15 * Math.max(...envelope, 1e-30), circle = (r) => ({ x: angle.map((a) => r * Math.cos(a)), y: angle.map((a) => r * Math.sin(a)), mode: "lines", line: { color: page.style("--rule"), width: 1 }, hoverinfo: "skip" });
    const flat = { visible: false, range: [-reach, reach] };
    Plotly.react(part("lobes"), [circle(reach / 1.15), circle(reach / 2.3),
      { x: envelope.map((r, i) => r * Math.cos(angle[i])), y: envelope.map((r, i) => r * Math.sin(angle[i])), mode: "lines", fill: "toself", fillcolor: "rgba(0,114,178,0.15)", line: { color: page.colour("#0072b2"), width: 2 },
        text: envelope.map((r, i) => `${Math.round((angle[i] * 180) / Math.PI)}°: ${value(r)}`), hovertemplate: "%{text}<extra></extra>" }],
      { ...look(`Envelope of mesh harmonic ${harmonic} over the carrier's angle; outer circle ${value(reach / 1.15)} ${detector(false)}`), xaxis: flat, yaxis: { ...flat, scaleanchor: "x" } }, quiet);
  };

  // sound: whole turns of the carrier, looped; one scale for all speeds, so that louder is louder
  const audio = { context: null, node: null, gain: null };
  const turns = (i, rate) => {
    const name = source.value, loops = Math.max(1, Math.round(data.carrier[i])), seconds = loops / data.carrier[i];
    const length = Math.round(seconds * rate), samples = new Float32Array(length + 1), step = seconds / length;
    let peak = 0;
    at(i, name).filter((one) => one.size > 0 && one.hertz < 0.45 * rate).forEach((one) => {
      const turn = 2 * Math.PI * one.hertz * step, c = Math.cos(turn), s = Math.sin(turn);
      let re = one.re, im = one.im;
      for (let j = 0; j <= length; j++) {
        samples[j] += re;
        [re, im] = [re * c - im * s, re * s + im * c];
      }
    });
    for (const value of samples) peak = Math.max(peak, Math.abs(value));
    return { samples, rate: length / seconds, peak };
  };
  let loudest = {};
  const full = (name) => loudest[name] ||= Math.max(...data.speed.map((_, i) => at(i, name).reduce((sum, one) => sum + one.size, 0)));
  // two runs on one page have one scale, and are heard one after the other
  const player = { full: (name) => (lines[name] ? full(name) : 0), silence: () => { if (audio.node) play.click(); } };
  (page.players ||= []).push(player);
  const scaleOf = (name) => 1 / Math.max(...page.players.map((one) => one.full(name)));
  const sound = () => {
    if (!audio.context) return;
    const { samples } = turns(index, audio.context.sampleRate), scale = scaleOf(source.value);
    const buffer = audio.context.createBuffer(1, samples.length - 1, audio.context.sampleRate);
    buffer.copyToChannel(samples.subarray(0, -1).map((value) => value * scale), 0);
    const node = audio.context.createBufferSource(), gain = audio.context.createGain(), now = audio.context.currentTime;
    node.buffer = buffer;
    node.loop = true;
    gain.gain.setValueAtTime(0, now);
    gain.gain.linearRampToValueAtTime(10 ** (Number(volume.value) / 20), now + 0.06);
    node.connect(gain).connect(audio.context.destination);
    node.start();
    stop(now);
    Object.assign(audio, { node, gain });
  };
  const stop = (now) => {
    if (!audio.node) return;
    audio.gain.gain.cancelScheduledValues(now);
    audio.gain.gain.setValueAtTime(audio.gain.gain.value, now);
    audio.gain.gain.linearRampToValueAtTime(0, now + 0.06);
    audio.node.stop(now + 0.08);
    audio.node = null;
  };
  play.addEventListener("click", () => {
    if (audio.node) { stop(audio.context.currentTime); play.textContent = "Listen"; play.setAttribute("aria-pressed", "false"); return; }
    page.players.forEach((one) => one.silence());
    audio.context ||= new AudioContext();
    audio.context.resume();
    sound();
    play.textContent = "Silence";
    play.setAttribute("aria-pressed", "true");
  });
  volume.addEventListener("input", () => { if (audio.node) audio.gain.gain.value = 10 ** (Number(volume.value) / 20); });

  const walk = () => {
    index = Number(slider.value);
    const mesh = data.mesh[index];
    shown.value = `${data.speed[index].toPrecision(6)} rpm, mesh ${mesh.toPrecision(5)} Hz, ${told(shownOf(hear(index, source.value)))} ${detector(false)}${short(index) ? ": the excitation ends short (W-EXCITATION)" : ""}`;
    slider.setAttribute("aria-valuetext", shown.value);
    const cursor = [{ type: "line", x0: data.speed[index], x1: data.speed[index], yref: "paper", y0: 0, y1: 1, line: { color: page.colour("#d55e00"), width: 1.5 } }];
    const campbellDiv = part("campbell");
    if (campbellDiv.data) {
      const dots = Array.from({ length: data.harmonics }, (_, h) => (h + 1) * mesh);
      Plotly.restyle(campbellDiv, { x: [dots.map(() => data.speed[index])], y: [dots] }, [campbellDiv.data.length - 1]);
      Plotly.relayout(campbellDiv, { shapes: cursor });
      Plotly.relayout(part("level"), { shapes: cursor });
    }
    spectrum();
    lobes();
    if (audio.node) sound();
  };
  const over = () => {
    forms.forEach(([unit, , reference, , , peak], i) => {
      const air = source.value === "pressure", text = reference ? "dB" : `${air ? "Pa" : unit} ${peak ? "peak" : "r.m.s."}`;
      Object.assign(part("form").options[i], { text, hidden: air && i > 1 && !reference });
    });
    [levels, waterfall, cuts, follow, walk].forEach((one) => one());
  };
  const all = () => { campbell(); over(); };
  slider.addEventListener("input", walk);
  source.addEventListener("change", over);
  [part("form"), band, weighted, part("orders")].forEach((one) => one.addEventListener("change", over));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => setTimeout(all));
  let width = 0;
  new ResizeObserver(() => { if (Math.abs(root.clientWidth - width) > 4) { width = root.clientWidth; all(); } }).observe(root);
  addEventListener("beforeprint", all);
  addEventListener("afterprint", () => setTimeout(all));
  root.explorer = { turns, linesAt: at, hear, shownOf, words, scaleOf };
};
page.parts.push(() => document.querySelectorAll(".runup").forEach(page.explorer));
