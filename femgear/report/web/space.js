// A gearbox in space: gears with their teeth, shafts, bearings; deflection and modes of its stations.
"use strict";

page.space = () => {
  const model = page.data.space, place = document.getElementById("solid-place");
  if (!model || !place) return;
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  const outer = model.bodies.filter(({ kind }) => kind !== "sensor" && kind !== "foot");
  if (model.casing) [0, 1, 2].forEach((k) => { low[k] = model.casing[0][k]; high[k] = model.casing[1][k]; });
  outer.forEach(({ axis, ends, radii }) => [0, 1, 2].forEach((k) => {
    const reach = k < 2 ? Math.max(...radii) : 0, at = k < 2 ? [axis[k]] : ends;
    low[k] = Math.min(low[k], ...at.map((one) => one - reach));
    high[k] = Math.max(high[k], ...at.map((one) => one + reach));
  }));
  const middle = low.map((one, k) => (one + high[k]) / 2), size = (model.casing ? 1.15 : 1) * Math.hypot(...low.map((one, k) => high[k] - one));
  // long boxes from the side, flat ones from the front
  const flat = high[2] - low[2] < 0.5 * Math.max(high[0] - low[0], high[1] - low[1]);
  const view = page.view(place, size / 2, flat ? [0.75, -1.5, 2.7] : [2.35, 1.05, 1.7]);
  if (!view) return;
  const { group, render, camera, canvas } = view;
  const COLOURS = { shaft: [0.62, 0.65, 0.69], bearing: [0.30, 0.33, 0.38], sensor: [0.80, 0.24, 0.0], foot: [0.16, 0.16, 0.18] };
  const GEARS = [[0.34, 0.63, 0.83], [0.90, 0.66, 0.30], [0.30, 0.68, 0.56], [0.80, 0.60, 0.75]];
  const members = Object.fromEntries(Object.entries(model.members).map(([name, { rows, place: at }]) => [name, { rows, at }]));

  // outline in layers from the first to the second end: outer or toothed wall, inner wall, and both faces
  const AROUND = 40;
  const ring = (radius, count) => Array.from({ length: count }, (_, i) => [Math.cos((2 * Math.PI * i) / count) * radius, Math.sin((2 * Math.PI * i) / count) * radius]);
  const toothed = ({ section, teeth, short, internal }) => {
    const points = [], reach = new Map(short || []);
    for (let k = 0; k < teeth; k++) {
      const c = Math.cos((2 * Math.PI * k) / teeth), s = Math.sin((2 * Math.PI * k) / teeth);
      // the last point of a sector is the first one of the next
      for (let i = 0; i < section.length - 2; i += 2) {
        const factor = page.shortened(section[i], section[i + 1], reach.get(k), internal);
        points.push([factor * (c * section[i] - s * section[i + 1]), factor * (s * section[i] + c * section[i + 1])]);
      }
    }
    return points;
  };
  const bodyOf = (body) => {
    const own = members[body.member], [z0, z1] = body.ends, twist = body.twist || 0;
    const layers = Math.max(1, Math.min(12, Math.ceil(Math.abs(twist) / 0.05)), body.kind === "shaft" ? Math.ceil(Math.abs(z1 - z0) / (0.03 * size)) : 1);
    const outline = body.section ? toothed(body) : null, count = outline ? outline.length : AROUND;
    const position = [], index = [];
    const layer = (points, z, turn) => {
      const first = position.length / 3, c = Math.cos(turn), s = Math.sin(turn);
      points.forEach(([x, y]) => position.push(body.axis[0] + c * x - s * y, body.axis[1] + s * x + c * y, z));
      return first;
    };
    const wall = (a, b, n, inside) => {
      for (let i = 0; i < n; i++) {
        const j = (i + 1) % n, quad = inside ? [a + i, b + i, a + j, a + j, b + i, b + j] : [a + i, a + j, b + i, a + j, b + j, b + i];
        index.push(...quad);
      }
    };
    const rings = [0, 1].map(() => []);
    for (let k = 0; k <= layers; k++) {
      const share = k / layers, z = z0 + share * (z1 - z0), turn = (body.angle || 0) + share * twist;
      const plain = [0, 1].map((which) => body.radii[which] + share * (body.radii[2 + which] - body.radii[which]));
      const teethAt = outline || null;
      // teeth inside of a rim, outside of a bore, or bodies of revolution
      const inner = outline && body.internal ? teethAt : ring(Math.max(outline ? body.radii[0] : plain[0], 1e-6), count);
      const outer = outline && !body.internal ? teethAt : ring(outline ? body.radii[0] : plain[1], count);
      rings[0].push(layer(inner, z, turn));
      rings[1].push(layer(outer, z, turn));
    }
    for (let k = 0; k < layers; k++) {
      wall(rings[1][k], rings[1][k + 1], count, false);
      wall(rings[0][k], rings[0][k + 1], count, true);
    }
    [[0, true], [layers, false]].forEach(([k, back]) => {
      for (let i = 0; i < count; i++) {
        const j = (i + 1) % count, a = rings[0][k], b = rings[1][k];
        index.push(...(back ? [a + i, a + j, b + i, a + j, b + j, b + i] : [a + i, b + i, a + j, a + j, b + i, b + j]));
      }
    });
    const rest = Float32Array.from(position), points = rest.length / 3;
    const shape = new THREE.BufferGeometry(), at = Float32Array.from(rest), colour = new Float32Array(rest.length);
    for (let i = 0; i < points; i++) [0, 1, 2].forEach((k) => { at[3 * i + k] -= middle[k]; });
    shape.setIndex(index);
    shape.setAttribute("position", new THREE.BufferAttribute(at, 3));
    shape.setAttribute("color", new THREE.BufferAttribute(colour, 3));
    group.add(new THREE.Mesh(shape, new THREE.MeshLambertMaterial({ vertexColors: true, flatShading: true })));
    // vertices of faulty teeth in all layers, and one at the tip of each
    const of = outline && body.section.length / 2 - 1, marked = body.marked || [], mark = new Uint8Array(points), wallOf = rings[body.internal ? 0 : 1];
    const tips = marked.map(([k, text]) => {
      wallOf.forEach((first) => mark.fill(1, first + k * of, first + (k + 1) * of));
      return { text, vertex: wallOf[layers] + k * of + Math.floor(of / 2) };
    });
    return { ...body, rest, at, colour, shape, points, stations: own, mark, tips };
  };
  const bodies = model.bodies.map(bodyOf);
  bodies.forEach(({ tips, at }) => tips.forEach(({ text, vertex }) => page.tag(view, text, () => at.subarray(3 * vertex, 3 * vertex + 3))));

  // a pale box with edges for a casing: near a station on it the box moves as that station does
  const box = [];
  if (model.casing) {
    const parts = 8, corner = (place) => [0, 1, 2].map((k) => model.casing[0][k] + place[k] * (model.casing[1][k] - model.casing[0][k]));
    const add = (points, index, material) => {
      const rest = Float32Array.from(points.flat()), at = Float32Array.from(rest, (value, i) => value - middle[i % 3]);
      const shape = new THREE.BufferGeometry();
      shape.setIndex(index);
      shape.setAttribute("position", new THREE.BufferAttribute(at, 3));
      group.add(new THREE.Mesh(shape, new THREE.MeshLambertMaterial({ color: 0x6c7680, side: 2, flatShading: true, ...material })));
      box.push({ rest, at, shape, field: new Float32Array(rest.length) });
    };
    const points = [], index = [], bars = [], barIndex = [];
    [0, 1, 2].forEach((axis) => {
      const [one, other] = [0, 1, 2].filter((k) => k !== axis);
      [0, 1].forEach((side) => {
        const first = points.length;
        for (let i = 0; i <= parts; i++) for (let j = 0; j <= parts; j++) {
          const place = [0, 0, 0];
          [place[axis], place[one], place[other]] = [side, i / parts, j / parts];
          points.push(corner(place));
          const a = first + i * (parts + 1) + j, b = a + parts + 1;
          if (i < parts && j < parts) index.push(a, b, a + 1, a + 1, b, b + 1);
        }
      });
      // edges are thin bars: three.min.js of this page has no lines
      [[0, 0], [0, 1], [1, 0], [1, 1]].forEach((ends) => {
        const first = bars.length, thick = 0.0025 * size;
        for (let i = 0; i <= parts; i++) for (let k = 0; k < 4; k++) {
          const place = [0, 0, 0];
          [place[axis], place[one], place[other]] = [i / parts, ...ends];
          const point = corner(place);
          point[one] += thick * Math.cos((k * Math.PI) / 2);
          point[other] += thick * Math.sin((k * Math.PI) / 2);
          bars.push(point);
          const a = first + 4 * i + k, b = first + 4 * i + ((k + 1) % 4);
          if (i < parts) barIndex.push(a, a + 4, b, b, a + 4, b + 4);
        }
      });
    });
    add(points, index, { transparent: true, opacity: 0.13, depthWrite: false });
    add(bars, barIndex, {});
  }
  const seats = (model.casing_members || []).flatMap((name) => members[name].rows.map((row, i) => ({ row, at: members[name].at.slice(3 * i, 3 * i + 3) })));
  // D. Shepard, A two-dimensional interpolation function for irregularly-spaced data (1968): weights 1/distance^2
  const boxField = ({ rest, field }, moved, turned) => {
    field.fill(0);
    for (let i = 0; i < rest.length && seats.length; i += 3) {
      let whole = 0;
      seats.forEach(({ row, at }) => {
        const arm = [0, 1, 2].map((k) => rest[i + k] - at[k]), weight = 1 / (arm[0] ** 2 + arm[1] ** 2 + arm[2] ** 2 + 1e-9);
        const [a, b, c] = [0, 1, 2].map((k) => turned[3 * row + k]);
        const motion = [b * arm[2] - c * arm[1], c * arm[0] - a * arm[2], a * arm[1] - b * arm[0]];
        motion.forEach((value, k) => { field[i + k] += weight * (moved[3 * row + k] + value); });
        whole += weight;
      });
      [0, 1, 2].forEach((k) => { field[i + k] /= whole; });
    }
  };

  // motion of every vertex: of a member of several stations between the two that are next to it along z
  const fieldOf = (body, moved, turned) => {
    const field = new Float32Array(3 * body.points);
    if (!body.stations) return field;
    const { rows, at } = body.stations, single = rows.length === 1;
    for (let i = 0; i < body.points; i++) {
      const [x, y, z] = [body.rest[3 * i], body.rest[3 * i + 1], body.rest[3 * i + 2]];
      let k = 0;
      while (k < rows.length - 2 && at[3 * (k + 1) + 2] < z) k++;
      const next = single ? k : k + 1, span = single ? 1 : at[3 * next + 2] - at[3 * k + 2];
      const share = single || !span ? 0 : Math.min(Math.max((z - at[3 * k + 2]) / span, 0), 1);
      const mix = (values, part) => (1 - share) * values[3 * rows[k] + part] + share * values[3 * rows[next] + part];
      const arm = [x - at[3 * k], y - at[3 * k + 1], z - (single ? at[3 * k + 2] : at[3 * k + 2] + share * span)];
      const turn = [0, 1, 2].map((part) => mix(turned, part));
      field[3 * i] = mix(moved, 0) + turn[1] * arm[2] - turn[2] * arm[1];
      field[3 * i + 1] = mix(moved, 1) + turn[2] * arm[0] - turn[0] * arm[2];
      field[3 * i + 2] = mix(moved, 2) + turn[0] * arm[1] - turn[1] * arm[0];
    }
    return field;
  };
  const sizes = (field) => Float32Array.from({ length: field.length / 3 }, (_, i) => Math.hypot(field[3 * i], field[3 * i + 1], field[3 * i + 2]));

  const chooser = document.getElementById("solid-view"), bar = document.getElementById("solid-bar");
  const scale = document.getElementById("solid-scale");
  const turning = model.bodies.some(({ turns }) => turns);
  ["at rest", ...model.motions.map(({ title }) => title)].forEach((text, i) => chooser.add(new Option(text, String(i))));
  if (turning) chooser.add(new Option("turning", "turning"));
  const state = { fields: [], factor: 0, moving: false, swings: false, unit: "" };
  const paint = (body, tintOf) => {
    for (let i = 0; i < body.points; i++) body.colour.set((body.mark[i] ? page.FAULT : tintOf(i)).map(page.linear), 3 * i);
    body.shape.attributes.color.needsUpdate = true;
  };
  const choose = () => {
    const motion = model.motions[Number(chooser.value) - 1];
    state.turning = chooser.value === "turning";
    scale.disabled = state.turning || !motion;
    if (!motion) {
      state.fields = bodies.map((body) => new Float32Array(3 * body.points));
      state.factor = 0;
      box.forEach(({ field }) => field.fill(0));
      bodies.forEach((body) => paint(body, () => (body.kind === "gear" ? GEARS[body.stage % GEARS.length] : COLOURS[body.kind])));
      bar.textContent = "";
    } else {
      const moved = page.unpack(motion.moved), turned = page.unpack(motion.turned);
      state.fields = bodies.map((body) => fieldOf(body, moved, turned));
      box.forEach((part) => boxField(part, moved, turned));
      const values = state.fields.map(sizes), top = Math.max(1e-12, ...values.map((one) => one.reduce((a, b) => Math.max(a, b), 0)));
      bodies.forEach((body, k) => paint(body, (i) => page.tint(values[k][i] / top)));
      state.factor = (0.05 * size) / top;
      page.legend(bar, motion.swings ? "displacement, relative" : "displacement [µm]", motion.swings ? "1" : (1e3 * top).toPrecision(3));
      state.unit = motion.swings ? ["", 1 / top] : [" µm", 1e3];
      state.values = values;
    }
    state.swings = Boolean(motion && motion.swings);
    draw(0);
  };
  // every body about its own axis, as fast as its teeth let it, and planets around that of their carrier
  const turn = (time) => {
    bodies.forEach((body) => {
      const angle = (body.turns || 0) * (time / 4000), c = Math.cos(angle), s = Math.sin(angle);
      const [ox, oy, rate] = body.orbit || [...body.axis, 0], around = rate * (time / 4000);
      const [dx, dy] = [body.axis[0] - ox, body.axis[1] - oy];
      const ax = ox + Math.cos(around) * dx - Math.sin(around) * dy, ay = oy + Math.sin(around) * dx + Math.cos(around) * dy;
      for (let i = 0; i < 3 * body.points; i += 3) {
        const x = body.rest[i] - body.axis[0], y = body.rest[i + 1] - body.axis[1];
        body.at[i] = ax + c * x - s * y - middle[0];
        body.at[i + 1] = ay + s * x + c * y - middle[1];
        body.at[i + 2] = body.rest[i + 2] - middle[2];
      }
      body.shape.attributes.position.needsUpdate = true;
    });
    render();
  };
  const draw = (time) => {
    if (state.turning) { turn(time); return; }
    const swing = state.swings ? Math.cos(time / 350) : state.moving ? 0.5 - 0.5 * Math.cos(time / 700) : 1, factor = state.factor * Number(scale.value) * swing;
    bodies.forEach((body, k) => {
      const field = state.fields[k];
      for (let i = 0; i < 3 * body.points; i++) body.at[i] = body.rest[i] - middle[i % 3] + factor * field[i];
      body.shape.attributes.position.needsUpdate = true;
    });
    box.forEach(({ rest, at, field, shape }) => {
      for (let i = 0; i < rest.length; i++) at[i] = rest[i] - middle[i % 3] + factor * field[i];
      shape.attributes.position.needsUpdate = true;
    });
    render();
  };
  page.controls(view, state, { draw, choose });

  // what is under the pointer: the nearest vertex to the eye within some pixels of it
  const tip = document.createElement("output");
  tip.className = "pointed";
  tip.hidden = true;
  place.append(tip);
  let asked = false;
  canvas.addEventListener("pointermove", (event) => {
    if (asked || event.buttons) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      const frame = canvas.getBoundingClientRect(), matrix = camera.projectionMatrix.clone().multiply(camera.matrixWorldInverse).elements;
      const px = event.clientX - frame.left, py = event.clientY - frame.top;
      let best = null;
      bodies.forEach((body, k) => {
        for (let i = 0; i < body.points; i++) {
          const x = body.at[3 * i], y = body.at[3 * i + 1], z = body.at[3 * i + 2];
          const w = matrix[3] * x + matrix[7] * y + matrix[11] * z + matrix[15];
          const sx = (0.5 + (0.5 * (matrix[0] * x + matrix[4] * y + matrix[8] * z + matrix[12])) / w) * frame.width;
          const sy = (0.5 - (0.5 * (matrix[1] * x + matrix[5] * y + matrix[9] * z + matrix[13])) / w) * frame.height;
          if (Math.hypot(sx - px, sy - py) < 9 && (!best || w < best.w)) best = { w, k, i };
        }
      });
      tip.hidden = !best;
      if (!best) return;
      const value = state.factor ? `: ${(state.values[best.k][best.i] * state.unit[1]).toPrecision(3)}${state.unit[0]}` : "";
      const { name, teeth } = bodies[best.k];
      tip.textContent = `${name}${teeth ? `, ${teeth} teeth` : ""}${value}`;
      tip.style.left = `${Math.min(px + 12, frame.width - 200)}px`;
      tip.style.top = `${Math.max(py - 28, 0)}px`;
    });
  });
  canvas.addEventListener("pointerleave", () => { tip.hidden = true; });
  choose();
  place.space = { bodies, box, state, view };
};
page.parts.push(page.space);
