// A place of the page that shows bodies in space: light, camera, mouse, keys, resizing, paper; drawn by three.js.
"use strict";

// from grey to dark red, darker all the way: told apart with every kind of colour vision
page.HEAT = [[208, 214, 220], [226, 203, 150], [233, 163, 66], [206, 96, 24], [122, 28, 10]];
page.tint = (share) => {
  const at = Math.min(Math.max(share, 0), 1) * (page.HEAT.length - 1), i = Math.min(Math.floor(at), page.HEAT.length - 2);
  return page.HEAT[i].map((low, k) => (low + (at - i) * (page.HEAT[i + 1][k] - low)) / 255);
};
page.linear = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
// what pulls a point of a sector to the radius that a short tooth reaches; 1 of a whole one
page.shortened = (x, y, reach, internal) => {
  const radius = Math.hypot(x, y);
  return reach !== undefined && (internal ? radius < reach : radius > reach) ? reach / radius : 1;
};
page.unpack = ({ unit, values }) => {
  const bytes = Uint8Array.from(atob(values), (letter) => letter.charCodeAt(0));
  return Float32Array.from(new Int16Array(bytes.buffer), (whole) => whole * unit);
};
page.legend = (bar, text, largest) => {
  const stops = page.HEAT.map((one) => `rgb(${one.join(",")})`).join(",");
  bar.replaceChildren(`${text}: 0 `);
  const strip = document.createElement("span");
  strip.style.cssText = `display:inline-block;width:12rem;height:0.8rem;margin:0 0.5rem;background:linear-gradient(90deg,${stops})`;
  bar.append(strip, largest);
};

// colour of faulty teeth, which is none of stresses, gears and paths of contact
page.FAULT = [0.85, 0.0, 0.55];

// words in a corner with a line to a point in space, which follows it; at tells where it is
page.tag = (view, text, at) => {
  const [line, node] = ["tag-line", "pointed tag"].map((name) => { const one = document.createElement("div"); one.className = name; view.place.append(one); return one; });
  node.textContent = text;
  node.style.top = `${6 + 30 * view.tags.length}px`;
  view.tags.push({ node, line, at });
};

// null without WebGL; radius is that of what is shown, from the direction in which it is first seen
page.view = (place, radius, from) => {
  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
  } catch {
    place.textContent = "This browser has no WebGL; the pictures below show the set.";
    return null;
  }
  place.append(renderer.domElement);
  renderer.domElement.tabIndex = 0;
  renderer.domElement.setAttribute("aria-label", "The gears in space; arrow keys turn them");
  const scene = new THREE.Scene(), group = new THREE.Group();
  scene.add(group, new THREE.HemisphereLight(0xffffff, 0x777777, 2.6));
  const camera = new THREE.PerspectiveCamera(32, 1, radius / 50, radius * 40);
  camera.position.set(...from.map((one) => one * radius));
  const orbit = new THREE.OrbitControls(camera, renderer.domElement);
  const tags = [];
  const render = () => {
    renderer.render(scene, camera);
    const m = camera.projectionMatrix.clone().multiply(camera.matrixWorldInverse).elements, { clientWidth: w, clientHeight: h } = place;
    tags.forEach(({ node, line, at }) => {
      const [x, y, z] = at(), depth = m[3] * x + m[7] * y + m[11] * z + m[15];
      const left = (0.5 + (0.5 * (m[0] * x + m[4] * y + m[8] * z + m[12])) / depth) * w, top = (0.5 - (0.5 * (m[1] * x + m[5] * y + m[9] * z + m[13])) / depth) * h;
      const from = [node.offsetLeft + node.offsetWidth, node.offsetTop + 0.5 * node.offsetHeight], across = left - from[0], down = top - from[1];
      Object.assign(line.style, { left: `${from[0]}px`, top: `${from[1]}px`, width: `${Math.hypot(across, down)}px`, transform: `rotate(${Math.atan2(down, across)}rad)` });
    });
  };
  orbit.addEventListener("change", render);
  renderer.domElement.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
    if (!step) return;
    event.preventDefault();
    const p = camera.position, length = p.length();
    const around = Math.atan2(p.x, p.z) + step[0], up = Math.asin(p.y / length) + step[1], clipped = Math.min(Math.max(up, -1.5), 1.5);
    p.set(length * Math.cos(clipped) * Math.sin(around), length * Math.sin(clipped), length * Math.cos(clipped) * Math.cos(around));
    camera.lookAt(0, 0, 0);
    render();
  });
  const reset = () => { camera.position.set(...from.map((one) => one * radius)); orbit.target.set(0, 0, 0); orbit.update(); render(); };
  const fit = () => {
    const { clientWidth: w, clientHeight: h } = place;
    if (!w || !h) return;
    renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    renderer.setSize(w, h, false);
    camera.aspect = w / h;
    // a narrow view shows the whole width of the set
    camera.fov = 32 / Math.min(1, camera.aspect);
    camera.updateProjectionMatrix();
    render();
  };
  new ResizeObserver(fit).observe(place);
  // paper shows what was drawn last: a plain copy stands for the canvas, whose picture may come too late
  const copy = document.createElement("canvas");
  addEventListener("beforeprint", () => {
    place.append(copy);
    renderer.domElement.style.display = "none";
    fit();
    [copy.width, copy.height] = [renderer.domElement.width, renderer.domElement.height];
    copy.getContext("2d").drawImage(renderer.domElement, 0, 0);
  });
  addEventListener("afterprint", () => {
    copy.remove();
    renderer.domElement.style.display = "";
    setTimeout(fit);
  });
  // a browser has few of these, so one that is not needed any more is given back
  const dispose = () => { renderer.dispose(); renderer.forceContextLoss(); renderer.domElement.remove(); };
  return { group, camera, orbit, render, reset, dispose, place, tags, canvas: renderer.domElement };
};

// choice, motion, magnification and reset of a view, whose state tells whether it is moving
page.controls = (view, state, { draw, choose }) => {
  const part = (name) => document.getElementById(`solid-${name}`), button = part("play");
  const run = (time) => { if (state.moving) { draw(time); requestAnimationFrame(run); } };
  const play = (moving) => {
    state.moving = moving;
    button.textContent = moving ? "Pause" : "Move";
    button.setAttribute("aria-pressed", String(moving));
    if (moving) requestAnimationFrame(run); else draw(0);
  };
  button.addEventListener("click", () => play(!state.moving));
  part("view").addEventListener("change", choose);
  part("scale").addEventListener("input", () => draw(0));
  part("reset").addEventListener("click", view.reset);
};
