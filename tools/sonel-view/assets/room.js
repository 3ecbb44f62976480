// The room: walls by material, sources, receivers, the listener, early reflections, maps.
"use strict";
// Of materials.
const COLORS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c564b", "#7f7f7f", "#bcbd22", "#6a3d9a"];
const colorOf = (index) => COLORS[index % COLORS.length];
// Of orders of reflection, as in the chart of early reflections.
const wayColor = (order) => order ? PALETTE[Math.min(order, PALETTE.length - 1)] : "#666";
const bytesOf = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;

// Ends of the pieces of contour lines between four neighbours each, whose values are taken as linear along the sides.
function contours(places, spacing, up, levels) {
  const [e, f] = [0, 1, 2].filter((axis) => Math.abs(up.getComponent(axis)) < 0.5);
  const steps = (at) => [e, f].map((axis) => Math.round((at.getComponent(axis) - places[0].at.getComponent(axis)) / spacing));
  const found = new Map(places.map((place) => [steps(place.at).join(), place]));
  const ends = [];
  for (const { at } of places) {
    const [i, j] = steps(at);
    const ring = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]].map((key) => found.get(key.join()));
    if (!ring.every(Boolean)) continue;
    for (const level of levels) {
      const cuts = ring.flatMap((a, side) => {
        const b = ring[(side + 1) % 4];
        return (a.value < level) === (b.value < level) ? [] : [a.at.clone().lerp(b.at, (level - a.value) / (b.value - a.value))];
      });
      // Four cuts are a saddle, two lines.
      ends.push(...cuts);
    }
  }
  return ends;
}

// Empties a group, on the graphics card too.
function clear(group) {
  for (const { geometry, material } of group.children) {
    geometry.dispose();
    material.dispose();
  }
  group.clear();
}

// `onMove` takes where the listener is dragged to, `onDrop` a source and where it was dropped.
class RoomView {
  constructor(room, onMove, onDrop) {
    this.onMove = onMove;
    this.onDrop = onDrop;
    this.canvas = byId("room");
    this.scene = new THREE.Scene();
    this.cut = new THREE.Plane(new THREE.Vector3(), Infinity);
    this.walls = new THREE.Group();
    this.ways = new THREE.Group();
    this.map = new THREE.Group();
    this.points = new THREE.Group();
    this.sun = new THREE.DirectionalLight(0xffffff, 1.3);
    this.scene.add(this.walls, this.ways, this.map, this.points, new THREE.AmbientLight(0xffffff, 2.1), this.sun);
    this.camera = new THREE.PerspectiveCamera(45, 1, 0.01, 1e5);
    try {
      this.renderer = new THREE.WebGLRenderer({ canvas: this.canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
    } catch {
      byId("tip").textContent = "This browser draws nothing in three dimensions (WebGL is off); all numbers are below.";
    }
    if (this.renderer) this.renderer.localClippingEnabled = true;
    this.load(room);
    this.dragging();
    new ResizeObserver(() => this.isTurned ? this.draw() : this.whole()).observe(this.canvas);
  }

  // Another room in the same place.
  load(room) {
    this.room = room;
    this.up = new THREE.Vector3(...room.up);
    this.sun.position.set(0.45, 0.3, 0.2).addScaledVector(this.up, 1);
    this.cut.normal.copy(this.up).negate();
    this.camera.up.copy(this.up);
    // The controls take what is up once.
    this.controls?.dispose();
    this.controls = new THREE.OrbitControls(this.camera, this.canvas);
    this.controls.addEventListener("change", () => this.draw());
    this.isTurned = false;
    // Until the reader turns it, the room fits whatever becomes of the window.
    this.controls.addEventListener("start", () => { this.isTurned = true; });
    for (const group of [this.walls, this.points, this.map, this.ways]) group.clear();
    byId("legend").replaceChildren();
    this.build();
    this.size = this.box.getSize(new THREE.Vector3()).length() || 1;
    this.spots();
    this.whole();
  }

  // Coordinates of the scene are kept as differences to its origin: screens have 32-bit floats.
  local(at) { return new THREE.Vector3(at[0] - this.room.origin[0], at[1] - this.room.origin[1], at[2] - this.room.origin[2]); }
  world(v) { return [v.x + this.room.origin[0], v.y + this.room.origin[1], v.z + this.room.origin[2]]; }

  build() {
    const vertices = new Float32Array(bytesOf(this.room.vertices));
    const position = new THREE.Float32BufferAttribute(vertices, 3);
    this.bodies = this.room.materials.map((material, index) => {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", position);
      geometry.setIndex([...new Uint32Array(bytesOf(material.corners))]);
      const solid = geometry.toNonIndexed();
      solid.computeVertexNormals();
      const look = { color: colorOf(index), clippingPlanes: [this.cut] };
      // Walls are drawn from within the room alone, so that one sees into it; sheets let one look through.
      const light = { color: new THREE.Color(look.color).lerp(new THREE.Color("#fff"), 0.55), clippingPlanes: [this.cut], polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 };
      solid.addGroup(0, material.closed, 0);
      solid.addGroup(material.closed, Infinity, 1);
      const front = new THREE.MeshLambertMaterial(light);
      const both = new THREE.MeshLambertMaterial({ ...light, side: THREE.DoubleSide, transparent: true, opacity: 0.5, depthWrite: false });
      const faces = new THREE.Mesh(solid, [front, both]);
      const edges = new THREE.LineSegments(new THREE.EdgesGeometry(solid, 20), new THREE.LineBasicMaterial({ ...look, transparent: true, opacity: 0.6 }));
      faces.userData.index = index;
      const body = new THREE.Group();
      body.add(faces, edges);
      this.walls.add(body);
      return { body, faces };
    });
    const legend = byId("legend");
    this.room.materials.forEach((material, index) => {
      const key = make("button");
      const swatch = make("span", "", "swatch");
      swatch.style.background = colorOf(index);
      key.append(swatch, material.name);
      key.title = "shows or hides these surfaces";
      key.setAttribute("aria-pressed", "true");
      key.onclick = () => {
        const body = this.bodies[index].body;
        body.visible = !body.visible;
        key.classList.toggle("off", !body.visible);
        key.setAttribute("aria-pressed", String(body.visible));
        this.draw();
      };
      legend.append(key);
    });
    this.box = new THREE.Box3();
    this.box.setFromObject(this.walls);
    for (const point of [...this.room.sources, ...this.room.receivers]) this.box.expandByPoint(this.local(point.at));
  }

  // Three edges of the box of the room with their coordinates in metres: those on the ground at its near corner, the upright one at its left.
  ruler() {
    const { min, max } = this.box, size = this.box.getSize(new THREE.Vector3()), rough = Math.max(...size.toArray()) / 8;
    const step = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000].find((step) => step >= rough) ?? 5000, ends = [];
    const isUpright = (axis) => Math.abs(this.up.getComponent(axis)) > 0.5, side = isUpright(2) ? 1 : 0;
    this.ticks = [];
    const note = (text, at) => this.ticks.push({ body: { position: at }, text: make("span", text, "tick") });
    for (const axis of [0, 1, 2]) {
      const foot = isUpright(axis) ? min.clone().setComponent(side, max.getComponent(side)) : min;
      const along = (metres) => foot.clone().setComponent(axis, metres), out = axis === 2 ? 0 : 2, [low, origin] = [min.getComponent(axis), this.room.origin[axis]];
      const high = low + size.getComponent(axis);
      ends.push(along(low), along(high));
      for (let at = Math.ceil((low + origin) / step) * step; at - origin <= high + 1e-6; at += step) {
        const end = along(at - origin);
        end.setComponent(out, end.getComponent(out) - 0.012 * this.size);
        ends.push(along(at - origin), end);
        note(`${at}`, end);
      }
      note(`${"xyz"[axis]} [m]`, along(high + 0.03 * this.size));
    }
    this.axes = new THREE.LineSegments(new THREE.BufferGeometry().setFromPoints(ends), new THREE.LineBasicMaterial({ color: "#888" }));
    this.points.add(this.axes);
  }

  spot(shape, color, at, name) {
    const mesh = new THREE.Mesh(shape, new THREE.MeshBasicMaterial({ color }));
    mesh.position.copy(this.local(at));
    mesh.userData.name = name;
    this.points.add(mesh);
    return mesh;
  }

  // The receivers, and the names of all that has one.
  placeReceivers(receivers) {
    this.points.remove(...this.receivers ?? []);
    this.receivers = receivers.map(({ name, at }) => this.spot(new THREE.SphereGeometry(0.0084 * this.size, 16, 12), "#7f7f7f", at, `receiver ${name}`));
    const bodies = [...this.sources, ...this.receivers], named = [...this.room.sources, ...receivers];
    this.names = [...named.map(({ name }, index) => ({ body: bodies[index], text: make("span", name) })), ...this.ticks];
    byId("names").replaceChildren(...this.names.map(({ text }) => text));
    this.draw();
  }

  spots() {
    const radius = 0.012 * this.size, spot = this.spot.bind(this);
    this.sources = this.room.sources.map((source) => {
      const body = spot(new THREE.OctahedronGeometry(1.3 * radius), "#d62728", source.at, `source ${source.name}`);
      if (source.directivity && source.directivity !== "omni" && source.aim) {
        const cone = spot(new THREE.ConeGeometry(0.8 * radius, 3 * radius), "#d62728", source.at, `source ${source.name} (${source.directivity})`);
        cone.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), new THREE.Vector3(...source.aim).normalize());
        body.userData.cone = cone;
      }
      return body;
    });
    this.ruler();
    this.placeReceivers(this.room.receivers);
    this.listener = spot(new THREE.SphereGeometry(1.2 * radius, 24, 16), "#e6a100", this.room.receivers[0]?.at ?? this.room.origin, "listener");
  }

  moveListener(at) {
    this.listener.position.copy(this.local(at));
    this.draw();
  }

  placeSources(places) {
    this.sources.forEach((body, index) => {
      const at = this.local(places[index]);
      body.position.copy(at);
      body.userData.cone?.position.copy(at);
    });
    this.draw();
  }

  // The whole room, from above a corner.
  whole() { this.look(true); }
  above() { this.look(false); }
  look(isSlanted) {
    const across = Math.abs(this.up.z) > 0.5 ? new THREE.Vector3(1, 0, 0) : new THREE.Vector3(0, 0, 1);
    const side = new THREE.Vector3().crossVectors(this.up, across);
    const center = this.box.getCenter(new THREE.Vector3());
    const from = isSlanted ? across.clone().multiplyScalar(-0.65).addScaledVector(side, -0.75).addScaledVector(this.up, 0.7) : this.up.clone().addScaledVector(side, -1e-3);
    this.resize();
    const distance = this.distanceOf(center, from.normalize());
    this.camera.position.copy(center).addScaledVector(from, distance);
    this.camera.near = distance / 1000;
    this.camera.far = distance * 10;
    this.controls.target.copy(center);
    this.controls.update();
    this.draw();
  }

  // How far from the center towards `from` a camera sees the box of the room, with a margin.
  distanceOf(center, from) {
    const right = new THREE.Vector3().crossVectors(this.up, from).normalize();
    const rise = new THREE.Vector3().crossVectors(from, right);
    // On a served page tools and legend lie over the picture.
    const over = document.body.classList.contains("served") ? Math.max(byId("tools").offsetHeight, byId("foot").offsetHeight) : 0;
    const tangent = Math.tan(0.5 * this.camera.fov * Math.PI / 180);
    const high = Math.max(0.5, 0.94 - 2 * over / (this.canvas.clientHeight || 1)) * tangent, wide = 0.94 * tangent * this.camera.aspect;
    const { min, max } = this.box, ends = [min, max];
    const distances = [0, 1, 2, 3, 4, 5, 6, 7].map((corner) => {
      const at = new THREE.Vector3(ends[corner & 1].x, ends[corner >> 1 & 1].y, ends[corner >> 2].z).sub(center);
      return at.dot(from) + Math.max(Math.abs(at.dot(right)) / wide, Math.abs(at.dot(rise)) / high);
    });
    return Math.max(0.1 * this.size, ...distances);
  }

  flyTo(at) {
    const target = this.local(at);
    const away = this.camera.position.clone().sub(this.controls.target).normalize().multiplyScalar(0.25 * this.size);
    this.controls.target.copy(target);
    this.camera.position.copy(target).add(away);
    this.controls.update();
    this.mark(at);
  }

  mark(at) {
    this.points.remove(this.marked);
    this.marked = new THREE.Mesh(new THREE.SphereGeometry(0.02 * this.size, 16, 12), new THREE.MeshBasicMaterial({ color: "#e377c2" }));
    this.marked.position.copy(this.local(at));
    this.points.add(this.marked);
    this.draw();
  }

  setWire(on) {
    for (const { faces } of this.bodies) faces.visible = !on;
    this.draw();
  }

  // Leaves the room up to a part of its size along an axis, or along what is up.
  setCut(part, axis) {
    const across = axis === "" ? this.up : new THREE.Vector3().setComponent(Number(axis), 1);
    const ends = [this.box.min, this.box.max].map((corner) => corner.dot(across)), low = Math.min(...ends);
    this.cut.normal.copy(across).negate();
    this.cut.constant = part >= 1 ? Infinity : low + part * (Math.max(...ends) - low) + 1e-6;
    this.draw();
  }

  setAxes(on) {
    this.axes.visible = on;
    this.ticks.forEach(({ text }) => text.classList.toggle("closed", !on));
    this.draw();
  }

  // Turns the view about what it looks at, to the right and up, and goes nearer to it.
  turn(right, rise, nearer = 1) {
    const arm = this.camera.position.clone().sub(this.controls.target).applyAxisAngle(this.up, right).multiplyScalar(nearer);
    const down = Math.min(Math.max(arm.angleTo(this.up) - rise, 0.01), Math.PI - 0.01) - arm.angleTo(this.up);
    arm.applyAxisAngle(new THREE.Vector3().crossVectors(this.up, arm).normalize(), down);
    this.isTurned = true;
    this.camera.position.copy(this.controls.target).add(arm);
    this.controls.update();
    this.draw();
  }

  // Lines of early reflections up to an order.
  showWays(ways, most) {
    clear(this.ways);
    for (const way of ways.filter((way) => way.order <= most)) {
      const geometry = new THREE.BufferGeometry().setFromPoints(way.corners.map((corner) => this.local(corner)));
      const line = new THREE.Line(geometry, new THREE.LineBasicMaterial({ color: wayColor(way.order) }));
      line.userData.way = way;
      this.ways.add(line);
    }
    this.draw();
  }

  // The line of a delay stands out; none without.
  pick(delay) {
    for (const line of this.ways.children) {
      const near = delay !== null && Math.abs(line.userData.way.delay - delay) < 1e-3;
      line.material.color.set(near ? "#e6a100" : wayColor(line.userData.way.order));
      line.renderOrder = near ? 1 : 0;
    }
    this.draw();
  }

  // Squares of a plane coloured by their values, and lines at `levels`.
  paint(places, spacing, values, unit, [low, high], levels) {
    this.unpaint();
    this.unit = unit;
    const shape = new THREE.PlaneGeometry(spacing, spacing);
    const turn = new THREE.Mesh();
    turn.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), this.up);
    places.forEach((at, index) => {
      const entry = values[index];
      if (!Array.isArray(entry)) return;
      const [r, g, b] = rampColor((entry[0] - low) / (high - low || 1));
      const square = new THREE.Mesh(shape, new THREE.MeshBasicMaterial({ color: `rgb(${r},${g},${b})`, side: THREE.DoubleSide, transparent: true, opacity: 0.85 }));
      square.position.copy(this.local(at));
      square.quaternion.copy(turn.quaternion);
      square.userData.entry = entry;
      this.map.add(square);
    });
    const known = places.map((at, index) => Array.isArray(values[index]) && { at: this.local(at), value: values[index][0] });
    const ends = contours(known.filter(Boolean), spacing, this.up, levels);
    const lines = new THREE.LineSegments(new THREE.BufferGeometry().setFromPoints(ends), new THREE.LineBasicMaterial({ color: "#111" }));
    lines.position.copy(this.up).multiplyScalar(1e-3 * this.size);
    this.map.add(lines);
    this.draw();
  }
  unpaint() { clear(this.map); this.draw(); }

  resize() {
    const { clientWidth, clientHeight } = this.canvas;
    if (!clientWidth || !this.renderer) return;
    this.renderer.setPixelRatio(window.devicePixelRatio);
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
  }

  // What is seen now, with names, for paper and files.
  picture() {
    if (!this.renderer) return null;
    this.renderer.render(this.scene, this.camera);
    const sheet = Object.assign(make("canvas"), { width: this.canvas.width, height: this.canvas.height }), pen = sheet.getContext("2d");
    pen.drawImage(this.canvas, 0, 0);
    pen.scale(window.devicePixelRatio, window.devicePixelRatio);
    pen.font = "12px system-ui,sans-serif";
    for (const { text, x, y } of this.placeNames()) pen.fillText(text.textContent, x, y + 14);
    return sheet;
  }

  draw() {
    if (!this.renderer || this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      this.resize();
      this.renderer.render(this.scene, this.camera);
      this.placeNames();
    });
  }

  // Names stand beside what they are of; of many the nearest to the reader, before coordinates. Those that are seen are returned.
  placeNames() {
    const { clientWidth, clientHeight } = this.canvas, taken = [];
    const isTick = ({ text }) => text.classList.contains("tick");
    const seen = this.names.map((name) => ({ ...name, at: name.body.position.clone().project(this.camera) })).sort((one, other) => isTick(one) - isTick(other) || one.at.z - other.at.z);
    for (const { text, at } of seen) {
      const wide = 10 + 7 * text.textContent.length, x = Math.min((at.x + 1) / 2 * clientWidth + 9, clientWidth - wide), y = (1 - at.y) / 2 * clientHeight - 9;
      const isFree = Math.abs(at.z) < 1 && taken.every((one) => x + wide < one.x || one.x + one.wide < x || Math.abs(one.y - y) > 14);
      text.hidden = !isFree || text.classList.contains("closed");
      if (text.hidden) continue;
      taken.push({ text, x, y, wide });
      text.style.transform = `translate(${x}px, ${y}px)`;
    }
    return taken;
  }

  // The listener or a source follows the mouse in its plane; with the shift key up and down. Elsewhere the mouse turns the room.
  dragging() {
    const ray = new THREE.Raycaster();
    const aim = (event) => {
      const frame = this.canvas.getBoundingClientRect();
      const mouse = new THREE.Vector2(2 * (event.clientX - frame.left) / frame.width - 1, 1 - 2 * (event.clientY - frame.top) / frame.height);
      ray.setFromCamera(mouse, this.camera);
    };
    // What is dragged, the plane it moves in (none up and down), and where the mouse took it.
    let held = null, pressed = null;
    this.canvas.addEventListener("pointerdown", (event) => {
      aim(event);
      pressed = { x: event.clientX, y: event.clientY };
      const movable = this.onMove ? [this.listener, ...(this.canTrace ? this.sources : [])] : [];
      const body = ray.intersectObjects(movable, false)[0]?.object;
      if (!body) return;
      const plane = event.shiftKey ? null : new THREE.Plane().setFromNormalAndCoplanarPoint(this.up, body.position);
      held = { body, plane, from: body.position.clone(), x: event.clientX, y: event.clientY, isMoved: false };
      this.controls.enabled = false;
      this.canvas.setPointerCapture(event.pointerId);
      event.stopImmediatePropagation();
    }, { capture: true });
    this.canvas.addEventListener("pointermove", (event) => {
      aim(event);
      if (!held) return this.hover(ray);
      // A click that trembles is no drag.
      held.isMoved ||= Math.hypot(event.clientX - held.x, event.clientY - held.y) > 3;
      if (!held.isMoved) return;
      const place = held.plane ? ray.ray.intersectPlane(held.plane, new THREE.Vector3()) : this.lifted(held, event);
      if (!place) return;
      if (held.body === this.listener) return this.onMove(this.world(place));
      held.body.position.copy(place);
      this.draw();
    });
    const end = (drops) => {
      if (held && !drops) held.body.position.copy(held.from);
      const { body, isMoved } = held ?? {};
      held = null;
      this.controls.enabled = true;
      const source = this.sources.indexOf(body);
      if (source < 0) return;
      if (drops && isMoved) this.onDrop(source, this.world(body.position));
      this.draw();
    };
    this.canvas.addEventListener("pointerup", (event) => {
      const isClick = pressed && !held?.isMoved && Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y) <= 3;
      aim(event);
      if (isClick && held?.body !== this.listener) this.click(ray);
      end(true);
    });
    this.canvas.addEventListener("pointercancel", () => end(false));
  }

  // A receiver or a surface is chosen.
  click(ray) {
    const [spot] = ray.intersectObjects(this.receivers);
    if (spot) return this.onPick?.({ receiver: this.receivers.indexOf(spot.object) });
    const [wall] = ray.intersectObjects(this.bodies.filter(({ body, faces }) => body.visible && faces.visible).map(({ faces }) => faces));
    if (wall) this.onPick?.({ material: wall.object.userData.index });
  }

  // Up and down as far as the mouse goes on the screen, whatever the view: from above, a plane through the mouse would lead far away.
  lifted({ from, y }, event) {
    const metresPerPixel = 2 * this.camera.position.distanceTo(from) * Math.tan(0.5 * this.camera.fov * Math.PI / 180) / this.canvas.clientHeight;
    return from.clone().addScaledVector(this.up, (y - event.clientY) * metresPerPixel);
  }

  hover(ray) {
    ray.params.Line.threshold = 0.006 * this.size;
    const tip = byId("tip");
    const [line] = ray.intersectObjects(this.ways.children);
    const [square] = ray.intersectObjects(this.map.children);
    const [spot] = ray.intersectObjects(this.points.children);
    const [wall] = ray.intersectObjects(this.bodies.filter(({ body, faces }) => body.visible && faces.visible).map(({ faces }) => faces));
    const way = line ? line.object.userData.way : null;
    if (way !== this.pointed) this.onHover?.(way);
    this.pointed = way;
    if (spot?.object.userData.name) tip.textContent = `${spot.object.userData.name} at ${this.world(spot.object.position).map((v) => v.toFixed(2)).join(", ")} m`;
    else if (line) {
      const { class: name, delay, strength } = line.object.userData.way;
      tip.textContent = `${name}: ${delay.toFixed(1)} ms after the direct sound, ${strength.toFixed(1)} dB`;
    } else if (square) tip.textContent = numberText(square.object.userData.entry, this.unit);
    else if (wall) {
      const material = this.room.materials[wall.object.userData.index];
      tip.textContent = `${material.name}: ${material.area.toFixed(1)} m², α ${material.absorption.map((a) => a.toFixed(2)).join(" ")}`;
    } else tip.textContent = "";
  }
}
