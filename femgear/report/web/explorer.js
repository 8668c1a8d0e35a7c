// A run-up to walk through: modes and mesh orders, level, spectrum, lobes and sound at one speed.
"use strict";

page.explorer = (root) => {
  const data = page.data[root.dataset.run], part = (name) => root.querySelector(`[data-part="${name}"]`);
  const count = data.order.length, unpack = ({ unit, values }) => {
    const bytes = Uint8Array.from(atob(values), (letter) => letter.charCodeAt(0)), whole = new Int16Array(bytes.buffer);
    return Float32Array.from(whole, (value, i) => value * unit[(i >> 1) % count]);
  };
  const lines = Object.fromEntries(Object.entries(data.lines).map(([name, packed]) => [name, unpack(packed)]));
  const units = { acceleration: "m/s²", pressure: "Pa" };
  const slider = part("speed"), shown = part("value"), source = part("source"), play = part("play"), volume = part("volume");
  slider.max = data.speed.length - 1;
  Object.keys(lines).forEach((name) => source.add(new Option({ acceleration: "accelerometer", pressure: "microphone" }[name], name)));
  if (lines.pressure) source.value = "pressure";
  let index = data.level.indexOf(Math.max(...data.level));
  slider.value = index;

  // amplitudes and phases of a speed
  const at = (i, name) => data.order.map((order, k) => {
    const re = lines[name][2 * (i * count + k)], im = lines[name][2 * (i * count + k) + 1];
    return { order, re, im, size: Math.hypot(re, im), hertz: order * data.carrier[i] };
  });
  const rms = (i, name) => Math.sqrt(at(i, name).reduce((sum, one) => sum + 0.5 * one.size ** 2, 0));

  const look = (title) => ({ paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", margin: { l: 62, r: 14, t: 34, b: 50 }, height: 330,
    font: { family: "system-ui, Segoe UI, DejaVu Sans, sans-serif", size: 12, color: page.style("--ink") }, showlegend: false, hovermode: "closest",
    title: { text: page.wrapped(title, root.clientWidth > 800 ? root.clientWidth / 2 - 80 : root.clientWidth - 70).text, x: 0, xref: "paper", font: { size: 13 } } });
  const axis = (title, more) => ({ title: { text: title }, gridcolor: page.style("--rule"), linecolor: page.style("--soft"), showline: true, zeroline: false,
    exponentformat: "power", automargin: true, ...(more.type === "log" ? { dtick: 1 } : { tickformat: ",~r" }), ...more });
  const quiet = { displaylogo: false, responsive: false, displayModeBar: false };
  const top = Math.max(...data.mesh) * (data.harmonics + 0.5), speeds = [data.speed[0], data.speed[data.speed.length - 1]];

  const campbell = () => {
    const traces = data.modes.map(([number, hertz, kind, colour]) => ({ x: speeds, y: [hertz, hertz], mode: "lines", line: { color: page.colour(colour), width: 1.2 },
      hovertemplate: `mode ${number}: ${hertz.toFixed(1)} Hz<br>${page.clear(kind)}<extra></extra>` }));
    for (let h = 1; h <= data.harmonics; h++) {
      traces.push({ x: data.speed, y: data.mesh.map((one) => h * one), mode: "lines", line: { color: page.colour("#808080"), width: 1, dash: "dot" },
        hovertemplate: `mesh harmonic ${h}<br>%{x:.5g} rpm, %{y:.5g} Hz<extra></extra>` });
    }
    const met = data.resonances.filter((one) => one[4] <= data.harmonics);
    traces.push({ x: met.map((one) => one[0]), y: met.map((one) => one[1]), mode: "markers",
      marker: { symbol: "circle-open", size: 9, color: page.colour("#d55e00"), line: { width: 2 } },
      text: met.map(([rpm, hertz, mode, kind, h]) => `${rpm.toFixed(1)} rpm: mode ${mode} (${page.clear(kind)})<br>${hertz.toFixed(1)} Hz, mesh harmonic ${h}`),
      hovertemplate: "%{text}<extra></extra>" });
    traces.push({ x: [], y: [], mode: "markers", marker: { size: 8, color: page.colour("#d55e00") }, hoverinfo: "skip" });
    const kinds = [...new Map(data.modes.map((one) => [one[2], one[3]]))];
    const layout = look("Modes, mesh orders and their resonances (circles)");
    layout.annotations = kinds.map(([kind, colour], i) => ({ text: page.clear(kind), xref: "paper", yref: "paper", x: 0.01 + (i % 3) * 0.34, y: 0.99 - Math.floor(i / 3) * 0.06,
      xanchor: "left", yanchor: "top", showarrow: false, font: { color: page.colour(colour), size: 11 }, bgcolor: page.style("--paper") }));
    Plotly.react(part("campbell"), traces, { ...layout, xaxis: axis("speed [rpm]", { range: speeds }), yaxis: axis("frequency [Hz]", { range: [0, top] }) }, quiet);
  };
  const levels = () => {
    const name = source.value, values = data.speed.map((_, i) => rms(i, name));
    Plotly.react(part("level"), [{ x: data.speed, y: values, mode: "lines", line: { color: page.colour("#0072b2"), width: 1.8 }, hovertemplate: "%{x:.5g} rpm: %{y:.4g}<extra></extra>" }],
      { ...look("Level over the speed"), xaxis: axis("speed [rpm]", { range: speeds }), yaxis: axis(`r.m.s. [${units[name]}]`, { type: "log" }) }, quiet);
  };
  const spectrum = () => {
    const found = at(index, source.value), x = [], y = [], largest = Math.max(...found.map((one) => one.size)) || 1;
    found.forEach((one) => { x.push(one.hertz, one.hertz, null); y.push(largest * 1e-4, Math.max(one.size, largest * 1e-4), null); });
    const tips = found.map((one) => `order ${one.order}, ${one.hertz.toFixed(1)} Hz<br>${one.size.toPrecision(4)} ${units[source.value]}`);
    const loud = found.filter((one) => one.size > largest * 1e-4);
    Plotly.react(part("spectrum"), [{ x, y, mode: "lines", line: { color: page.colour("#0072b2"), width: 1.4 }, hoverinfo: "skip" },
      { x: found.map((one) => one.hertz), y: found.map((one) => Math.max(one.size, largest * 1e-4)), mode: "markers", marker: { size: 4, color: page.colour("#0072b2") }, text: tips, hovertemplate: "%{text}<extra></extra>" }],
      { ...look("Lines at this speed"), xaxis: axis("frequency [Hz]", { range: [0, Math.max(...loud.map((one) => one.hertz)) * 1.03] }),
        yaxis: axis(`amplitude [${units[source.value]}]`, { type: "log", range: [Math.log10(largest * 1e-4), Math.log10(largest * 2)] }) }, quiet);
  };
  const lobes = () => {
    const found = at(index, source.value), bands = new Map();
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
        text: envelope.map((r, i) => `${Math.round((angle[i] * 180) / Math.PI)}°: ${r.toPrecision(3)} ${units[source.value]}`), hovertemplate: "%{text}<extra></extra>" }],
      { ...look(`Envelope of mesh harmonic ${harmonic} over the carrier's angle; outer circle ${(reach / 1.15).toPrecision(3)} ${units[source.value]}`), xaxis: flat, yaxis: { ...flat, scaleanchor: "x" } }, quiet);
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
  const sound = () => {
    if (!audio.context) return;
    const { samples } = turns(index, audio.context.sampleRate), scale = 1 / full(source.value);
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
    audio.context ||= new AudioContext();
    audio.context.resume();
    sound();
    play.textContent = "Silence";
    play.setAttribute("aria-pressed", "true");
  });
  volume.addEventListener("input", () => { if (audio.node) audio.gain.gain.value = 10 ** (Number(volume.value) / 20); });

  const walk = () => {
    index = Number(slider.value);
    const name = source.value, mesh = data.mesh[index];
    shown.value = `${data.speed[index].toPrecision(6)} rpm, mesh ${mesh.toPrecision(5)} Hz, ${rms(index, name).toPrecision(3)} ${units[name]} r.m.s.`;
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
  const all = () => { campbell(); levels(); walk(); };
  slider.addEventListener("input", walk);
  source.addEventListener("change", () => { levels(); walk(); });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => setTimeout(all));
  let width = 0;
  new ResizeObserver(() => { if (Math.abs(root.clientWidth - width) > 4) { width = root.clientWidth; all(); } }).observe(root);
  addEventListener("beforeprint", all);
  addEventListener("afterprint", () => setTimeout(all));
  root.explorer = { turns, linesAt: at };
};
page.parts.push(() => document.querySelectorAll(".runup").forEach(page.explorer));
