// The gear set in space: teeth, static state and modes, drawn by three.js.
"use strict";

page.solid = () => {
  const model = page.data.solid, place = document.getElementById("solid-place");
  if (!model || !place) return;
  const unpack = ({ unit, values }) => {
    const bytes = Uint8Array.from(atob(values), (letter) => letter.charCodeAt(0));
    return Float32Array.from(new Int16Array(bytes.buffer), (whole) => whole * unit);
  };
  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
  } catch {
    place.textContent = "This browser has no WebGL; the pictures below show the set.";
    return;
  }
  place.append(renderer.domElement);
  renderer.domElement.tabIndex = 0;
  renderer.domElement.setAttribute("aria-label", "The gear set in space; arrow keys turn it");
  const scene = new THREE.Scene(), group = new THREE.Group(), radius = model.radius;
  scene.add(group, new THREE.HemisphereLight(0xffffff, 0x777777, 2.6));
  const camera = new THREE.PerspectiveCamera(32, 1, radius / 50, radius * 40);
  camera.position.set(0.75 * radius, -1.8 * radius, 3.1 * radius);
  const orbit = new THREE.OrbitControls(camera, renderer.domElement);

  // from grey to dark red, darker all the way: told apart with every kind of colour vision
  const COLOURS = [[208, 214, 220], [226, 203, 150], [233, 163, 66], [206, 96, 24], [122, 28, 10]];
  const tint = (share) => {
    const at = Math.min(Math.max(share, 0), 1) * (COLOURS.length - 1), i = Math.min(Math.floor(at), COLOURS.length - 2);
    return COLOURS[i].map((low, k) => (low + (at - i) * (COLOURS[i + 1][k] - low)) / 255);
  };
  const linear = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);

  // all copies of a sector, in the frame of the set
  const bodies = model.bodies.map((body) => {
    const sector = model.sectors[body.kind], each = sector.points.length / 2, count = sector.count;
    const rest = new Float32Array(2 * each * count), moved = unpack(body.displacement), field = new Float32Array(moved.length);
    const triangles = [], walls = [];
    for (let k = 0; k < count; k++) {
      const turn = (2 * Math.PI * k) / count + body.angle, c = Math.cos(turn), s = Math.sin(turn);
      for (let i = 0; i < each; i++) {
        const x = sector.points[2 * i], y = sector.points[2 * i + 1], at = 2 * (k * each + i);
        rest[at] = body.centre[0] + c * x - s * y;
        rest[at + 1] = body.centre[1] + s * x + c * y;
        field[at] = c * moved[at] - s * moved[at + 1];
        field[at + 1] = s * moved[at] + c * moved[at + 1];
      }
      for (const i of sector.triangles) triangles.push(k * each + i);
      for (const i of sector.edges) walls.push(k * each + i);
    }
    const nodes = each * count, index = [], half = model.width / 2;
    for (let i = 0; i < triangles.length; i += 3) {
      const [a, b, d] = triangles.slice(i, i + 3);
      index.push(a, b, d, nodes + a, nodes + d, nodes + b);
    }
    for (let i = 0; i < walls.length; i += 2) {
      const [a, b] = walls.slice(i, i + 2);
      index.push(2 * nodes + a, 3 * nodes + a, 2 * nodes + b, 2 * nodes + b, 3 * nodes + a, 3 * nodes + b);
    }
    const position = new Float32Array(12 * nodes), colour = new Float32Array(12 * nodes);
    for (let i = 0; i < 4 * nodes; i++) position[3 * i + 2] = i % (2 * nodes) < nodes ? half : -half;
    const shape = new THREE.BufferGeometry();
    shape.setIndex(index);
    shape.setAttribute("position", new THREE.BufferAttribute(position, 3));
    shape.setAttribute("color", new THREE.BufferAttribute(colour, 3));
    group.add(new THREE.Mesh(shape, new THREE.MeshLambertMaterial({ vertexColors: true, flatShading: true })));
    return { ...body, rest, field, stress: unpack(body.stress), nodes, shape, position, colour };
  });

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
    for (let copy = 0; copy < 4; copy++) {
      for (let i = 0; i < body.nodes; i++) {
        const to = 3 * (copy * body.nodes + i);
        body.position[to] = body.rest[2 * i] + factor * field[2 * i];
        body.position[to + 1] = body.rest[2 * i + 1] + factor * field[2 * i + 1];
      }
    }
    body.shape.attributes.position.needsUpdate = true;
  };
  const paint = (body, values, largest) => {
    for (let i = 0; i < body.nodes; i++) {
      const colour = tint(values[i] / largest).map(linear);
      for (let copy = 0; copy < 4; copy++) body.colour.set(colour, 3 * (copy * body.nodes + i));
    }
    body.shape.attributes.color.needsUpdate = true;
  };
  const sizes = (field) => Float32Array.from({ length: field.length / 2 }, (_, i) => Math.hypot(field[2 * i], field[2 * i + 1]));

  // motion of every node in a mode: rigid bodies, and the ring by its waves as a thin bent beam
  const modal = (mode, body) => {
    const field = new Float32Array(2 * body.nodes), [x, y, turn] = mode.bodies[body.name] || [0, 0, 0];
    const carrier = mode.bodies.carrier || [0, 0, 0], own = body.name in mode.bodies;
    for (let i = 0; i < body.nodes; i++) {
      const px = body.rest[2 * i], py = body.rest[2 * i + 1], dx = px - body.centre[0], dy = py - body.centre[1];
      let u = own ? x - turn * dy : carrier[0], v = own ? y + turn * dx : carrier[1];
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
  const button = document.getElementById("solid-play"), scale = document.getElementById("solid-scale");
  ["von Mises stress, static, position 0", "displacement, static, position 0", ...model.modes.map((mode) => "mode " + mode.title)]
    .forEach((text, i) => chooser.add(new Option(text, String(i))));
  const state = { fields: [], factor: 1, moving: false, wave: false };
  const legend = (text, largest) => {
    const stops = COLOURS.map((one) => `rgb(${one.join(",")})`).join(",");
    bar.replaceChildren(`${text}: 0 `);
    const strip = document.createElement("span");
    strip.style.cssText = `display:inline-block;width:12rem;height:0.8rem;margin:0 0.5rem;background:linear-gradient(90deg,${stops})`;
    bar.append(strip, largest);
  };
  const choose = () => {
    const choice = Number(chooser.value);
    if (choice < 2) {
      state.fields = bodies.map((body) => body.field);
      const values = bodies.map((body, i) => (choice ? sizes(state.fields[i]) : body.stress));
      const all = Float32Array.from(values.flatMap((one) => [...one])).sort(), top = all[all.length - 1];
      // the stress under a point load has no bound: the colours end where three of ten thousand nodes lie above
      const largest = (choice ? top : all[Math.floor(0.9997 * all.length)]) || 1;
      bodies.forEach((body, i) => paint(body, values[i], largest));
      legend(choice ? "displacement [µm]" : "von Mises stress [MPa]", `${choice ? "" : "above "}${largest.toPrecision(3)}`);
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
    renderer.render(scene, camera);
  };
  const run = (time) => { if (state.moving) { draw(time); requestAnimationFrame(run); } };
  const play = (moving) => {
    state.moving = moving;
    button.textContent = moving ? "Pause" : "Move";
    button.setAttribute("aria-pressed", String(moving));
    if (moving) requestAnimationFrame(run); else draw(0);
  };
  button.addEventListener("click", () => play(!state.moving));
  chooser.addEventListener("change", choose);
  scale.addEventListener("input", () => draw(0));
  orbit.addEventListener("change", () => renderer.render(scene, camera));
  renderer.domElement.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
    if (!step) return;
    event.preventDefault();
    const p = camera.position, length = p.length();
    const around = Math.atan2(p.x, p.z) + step[0], up = Math.asin(p.y / length) + step[1], clipped = Math.min(Math.max(up, -1.5), 1.5);
    p.set(length * Math.cos(clipped) * Math.sin(around), length * Math.sin(clipped), length * Math.cos(clipped) * Math.cos(around));
    camera.lookAt(0, 0, 0);
    renderer.render(scene, camera);
  });
  new ResizeObserver(() => {
    const { clientWidth: w, clientHeight: h } = place;
    renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    renderer.setSize(w, h, false);
    camera.aspect = w / h;
    camera.updateProjectionMatrix();
    renderer.render(scene, camera);
  }).observe(place);
  choose();
};
page.parts.push(page.solid);
