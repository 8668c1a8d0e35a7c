// The gear set in space: teeth, static state and modes, drawn by three.js.
"use strict";

page.solid = () => {
  const model = page.data.solid, place = document.getElementById("solid-place");
  if (!model || !place) return;
  if (!model.pins.centres) {
    place.textContent = "An older femgear wrote these results, with other units of the modes: femgear run draws the set.";
    return;
  }
  const view = page.view(place, model.radius, [0.75, -1.8, 3.1]);
  if (!view) return;
  const { group, render } = view, radius = model.radius, { unpack } = page;

  // points of a sector beyond its root circle, which the cuts between teeth end at
  const toothOf = ({ points, count, internal }) => {
    const side = internal ? -1 : 1, polar = Array.from({ length: points.length / 2 }, (_, i) => [side * Math.hypot(points[2 * i], points[2 * i + 1]), Math.atan2(points[2 * i + 1], points[2 * i])]);
    const cuts = polar.filter(([, angle]) => Math.abs(Math.abs(angle) - Math.PI / count) < 1e-3 / count), root = Math.max(...cuts.map(([radius]) => radius));
    const tooth = new Set(polar.flatMap(([radius], i) => (radius > root ? [i] : [])));
    tooth.tip = polar.reduce((best, [radius], i) => (radius > polar[best][0] ? i : best), 0);
    return tooth;
  };

  // all copies of a sector in the frame of the set: both faces, and walls in layers that turn along the helix
  const LAYER = 0.06;
  const solidOf = (sector, body, field, stress) => {
    const each = sector.points.length / 2, count = sector.count, twist = sector.twist || 0;
    const layers = Math.max(1, Math.ceil(Math.abs(twist) / LAYER)), wall = [...new Set(sector.edges)], rank = new Map(wall.map((i, k) => [i, k]));
    const faces = 2 * each * count, across = wall.length * count, size = faces + (layers + 1) * across;
    const rest = new Float32Array(2 * size), moved = new Float32Array(2 * size), position = new Float32Array(3 * size);
    const node = new Int32Array(size), index = [], reach = new Map(body.short || []);
    const place = (to, k, i, share) => {
      const turn = (2 * Math.PI * k) / count + body.angle + share * twist, c = Math.cos(turn), s = Math.sin(turn), at = 2 * (k * each + i);
      const factor = page.shortened(sector.points[2 * i], sector.points[2 * i + 1], reach.get(k), sector.internal);
      const x = factor * sector.points[2 * i], y = factor * sector.points[2 * i + 1];
      rest[2 * to] = body.centre[0] + c * x - s * y;
      rest[2 * to + 1] = body.centre[1] + s * x + c * y;
      moved[2 * to] = c * field[at] - s * field[at + 1];
      moved[2 * to + 1] = s * field[at] + c * field[at + 1];
      position[3 * to + 2] = share * (sector.width || model.width);
      node[to] = k * each + i;
    };
    for (let k = 0; k < count; k++) {
      for (let i = 0; i < each; i++) {
        place(k * each + i, k, i, 0.5);
        place(each * count + k * each + i, k, i, -0.5);
      }
      for (let layer = 0; layer <= layers; layer++) {
        wall.forEach((i, j) => place(faces + layer * across + k * wall.length + j, k, i, 0.5 - layer / layers));
      }
      for (let i = 0; i < sector.triangles.length; i += 3) {
        const [a, b, d] = sector.triangles.slice(i, i + 3).map((one) => k * each + one), back = each * count;
        index.push(a, b, d, back + a, back + d, back + b);
      }
      for (let i = 0; i < sector.edges.length; i += 2) {
        for (let layer = 0; layer < layers; layer++) {
          const [a, b] = [sector.edges[i], sector.edges[i + 1]].map((one) => faces + layer * across + k * wall.length + rank.get(one));
          index.push(a, across + a, b, b, across + a, across + b);
        }
      }
    }
    const shape = new THREE.BufferGeometry(), colour = new Float32Array(3 * size);
    shape.setIndex(index);
    shape.setAttribute("position", new THREE.BufferAttribute(position, 3));
    shape.setAttribute("color", new THREE.BufferAttribute(colour, 3));
    group.add(new THREE.Mesh(shape, new THREE.MeshLambertMaterial({ vertexColors: true, flatShading: true })));
    // points of faulty teeth, and the point of each that is farthest from the rim
    const tooth = toothOf(sector), marked = new Set((body.marked || []).map(([k]) => k));
    const faulty = Uint8Array.from(node, (i) => marked.has(Math.floor(i / each)) && tooth.has(i % each));
    const tips = (body.marked || []).map(([k, text]) => ({ text, at: k * each + tooth.tip }));
    return { ...body, rest, field: moved, stress: Float32Array.from(node, (i) => stress[i]), size, nodes: each * count, shape, position, colour, faulty, tips };
  };
  const bodies = model.bodies.map((body) => solidOf(model.sectors[body.kind], { about: body.centre, ...body }, unpack(body.displacement), unpack(body.stress)));
  // the carrier is seen by its pins, which turn about the centre of the set
  const rim = Array.from({ length: 25 }, (_, i) => (i ? [Math.cos((i * Math.PI) / 12), Math.sin((i * Math.PI) / 12)].map((one) => one * model.pins.radius) : [0, 0])).flat();
  const round = Array.from({ length: 24 }, (_, i) => [i + 1, ((i + 1) % 24) + 1]);
  const pin = { count: 1, points: rim, triangles: round.flatMap((one) => [0, ...one]), edges: round.flat() };
  const still = new Float32Array(rim.length);
  model.pins.centres.forEach((centre) => bodies.push(solidOf(pin, { name: "carrier", kind: "pin", centre, angle: 0, about: [0, 0] }, still, still)));

  // paths of contact and, thinner, their lines of action, in front of the faces
  const stroke = (a, b, c, d, width) => {
    const side = (width * radius) / Math.hypot(c - a, d - b), x = side * (b - d), y = side * (c - a), z = 0.53 * model.width;
    return [a + x, b + y, z, a - x, b - y, z, c - x, d - y, z, c - x, d - y, z, c + x, d + y, z, a + x, b + y, z];
  };
  const corners = (model.paths || []).flatMap(([a, b, c, d]) => {
    const x = c - a, y = d - b;
    return [...stroke(a, b, c, d, 0.011), ...stroke(a - x, b - y, c + x, d + y, 0.004)];
  });
  const strokes = new THREE.BufferGeometry();
  strokes.setAttribute("position", new THREE.BufferAttribute(new Float32Array(corners), 3));
  strokes.computeVertexNormals();
  group.add(new THREE.Mesh(strokes, new THREE.MeshLambertMaterial({ color: 0x000000, emissive: 0x0072b2 })));

  const move = (body, field, factor) => {
    for (let i = 0; i < body.size; i++) {
      body.position[3 * i] = body.rest[2 * i] + factor * field[2 * i];
      body.position[3 * i + 1] = body.rest[2 * i + 1] + factor * field[2 * i + 1];
    }
    body.shape.attributes.position.needsUpdate = true;
  };
  const paint = (body, values, largest) => {
    for (let i = 0; i < body.size; i++) body.colour.set((body.faulty[i] ? page.FAULT : page.tint(values[i] / largest)).map(page.linear), 3 * i);
    body.shape.attributes.color.needsUpdate = true;
  };
  const sizes = (field) => Float32Array.from({ length: field.length / 2 }, (_, i) => Math.hypot(field[2 * i], field[2 * i + 1]));

  // motion of every node in a mode [mm]: rigid bodies, and the ring by its waves as a thin bent beam
  const modal = (mode, body) => {
    const field = new Float32Array(2 * body.size), [x, y, turn] = mode.bodies[body.name] || [0, 0, 0];
    for (let i = 0; i < body.size; i++) {
      const px = body.rest[2 * i], py = body.rest[2 * i + 1];
      let u = x - turn * (py - body.about[1]), v = y + turn * (px - body.about[0]);
      if (body.kind === "ring" && mode.ring.length) {
        const angle = Math.atan2(py, px), depth = Math.hypot(px, py) - radius;
        let radial = 0, along = 0, slope = 0;
        for (const [n, a, b, c, d] of mode.ring) {
          const cos = Math.cos(n * angle), sin = Math.sin(n * angle);
          radial += a * cos - b * sin;
          along += c * cos - d * sin;
          slope -= n * (a * sin + b * cos);
        }
        along += (depth * (along - slope)) / radius;
        u += radial * Math.cos(angle) - along * Math.sin(angle);
        v += radial * Math.sin(angle) + along * Math.cos(angle);
      }
      field[2 * i] = u;
      field[2 * i + 1] = v;
    }
    return field;
  };

  const chooser = document.getElementById("solid-view"), bar = document.getElementById("solid-bar");
  const scale = document.getElementById("solid-scale");
  ["von Mises stress, static, position 0", "displacement, static, position 0", ...model.modes.map((mode) => "mode " + mode.title)]
    .forEach((text, i) => chooser.add(new Option(text, String(i))));
  const state = { fields: [], factor: 1, moving: false, wave: false };
  const legend = (text, largest) => page.legend(bar, text, largest);
  const choose = () => {
    const choice = Number(chooser.value);
    if (choice < 2) {
      state.fields = bodies.map((body) => body.field);
      const values = bodies.map((body, i) => (choice ? sizes(state.fields[i]) : body.stress));
      const all = Float32Array.from(values.flatMap((one, i) => (bodies[i].kind === "pin" ? [] : [...one.subarray(0, bodies[i].nodes)]))).sort(), top = all[all.length - 1];
      // the stress under a point load has no bound: the colours end at the largest root stress that the verdict has, and without one
      // where three of ten thousand nodes lie above
      const ends = model.root_stress || all[Math.floor(0.9997 * all.length)], largest = (choice ? top : ends) || 1;
      bodies.forEach((body, i) => paint(body, values[i], largest));
      const plane = Object.values(model.sectors).some((sector) => sector.twist) ? ", of the transverse section, turned along the helix" : "";
      const end = choice ? largest.toPrecision(3) : model.root_stress ? `${largest.toFixed(0)}, the largest root stress` : `above ${largest.toPrecision(3)}`;
      legend(choice ? "displacement [µm]" : "von Mises stress [MPa]", `${end}${plane}`);
      state.factor = (0.03 * radius) / Math.max(...state.fields.map((field) => sizes(field).reduce((a, b) => Math.max(a, b), 1e-12)));
    } else {
      state.fields = bodies.map((body) => modal(model.modes[choice - 2], body));
      const values = state.fields.map(sizes), top = Math.max(...values.map((one) => one.reduce((a, b) => Math.max(a, b), 0))) || 1;
      bodies.forEach((body, i) => paint(body, values[i], top));
      legend("displacement, relative", "1");
      state.factor = (0.06 * radius) / top;
    }
    state.wave = choice >= 2;
    draw(0);
  };
  const draw = (time) => {
    const swing = state.wave ? Math.cos(time / 350) : state.moving ? 0.5 - 0.5 * Math.cos(time / 700) : 1;
    bodies.forEach((body, i) => move(body, state.fields[i], state.factor * Number(scale.value) * swing));
    render();
  };
  bodies.forEach(({ tips, position }) => tips.forEach(({ text, at }) => page.tag(view, text, () => position.subarray(3 * at, 3 * at + 3))));
  page.controls(view, state, { draw, choose });
  choose();
  place.solid = { bodies, state };
};
page.parts.push(page.solid);
