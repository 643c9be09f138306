// Camera, light, table, keys, and drawing on demand.
import {
  AmbientLight, Box3, BufferAttribute, BufferGeometry, CircleGeometry, Color, DirectionalLight, Group, HemisphereLight,
  LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial, PCFShadowMap, PerspectiveCamera, Quaternion, Scene,
  ShadowMaterial, Spherical, SRGBColorSpace, Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';

export class Stage {
  constructor(view, data) {
    this.view = view;
    this.scene = new Scene();
    this.data = data;
    this.listeners = [];
    this.up = new Vector3(...data.up).normalize();
    this.renderer = new WebGLRenderer({ antialias: true, alpha: true });
    this.renderer.outputColorSpace = SRGBColorSpace;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    const canvas = this.renderer.domElement;
    canvas.tabIndex = 0;
    canvas.setAttribute('role', 'application');
    canvas.setAttribute('aria-label', `The scene ${data.name} in three dimensions. Arrow keys turn it, plus and minus zoom, zero looks at all of it again. N and P choose a thing, Enter takes it and lets it go.`);
    view.prepend(canvas);
    this.canvas = canvas;
    this.camera = new PerspectiveCamera(32, 1, 0.005, 50);
    this.camera.up.copy(this.up);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener('change', () => this.draw());
    this.theme = window.matchMedia('(prefers-color-scheme: dark)');
    this.pending = false;
    this.measure();
  }

  get dark() {
    return this.theme.matches;
  }

  /** Called with the colours of the page now, and whenever they change. */
  onTheme(listener) {
    this.listeners.push(listener);
    listener(this.dark);
  }

  begin() {
    this.light();
    this.table();
    this.keys();
    this.theme.addEventListener('change', () => {
      this.listeners.forEach((listener) => listener(this.dark));
      this.draw();
    });
    new ResizeObserver(() => this.resize()).observe(this.view);
    this.resize();
    this.home();
  }

  measure() {
    this.corners = [];
    const turn = new Quaternion();
    for (const link of this.data.links) {
      if (!link.mesh) continue;
      turn.set(...link.pose.slice(3));
      const box = new Box3().setFromArray(link.mesh.positions);
      for (let i = 0; i < 8; i++) {
        const corner = new Vector3(i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y, i & 4 ? box.max.z : box.min.z);
        this.corners.push(corner.applyQuaternion(turn).add(new Vector3(...link.pose)));
      }
    }
    if (!this.corners.length) this.corners.push(new Vector3(-0.1, -0.1, 0), new Vector3(0.1, 0.1, 0.1));
    const box = new Box3().setFromPoints(this.corners);
    this.centre = box.getCenter(new Vector3());
    this.radius = Math.max(0.02, box.min.distanceTo(box.max) / 2);
  }

  light() {
    this.scene.add(new HemisphereLight(0xffffff, 0xcfc8bb, 2.1), new AmbientLight(0xffffff, 0.5));
    const sun = new DirectionalLight(0xfff6e8, 1.9);
    const side = this.sideways();
    sun.position.copy(this.centre).addScaledVector(this.up, 3 * this.radius)
      .addScaledVector(side[0], 1.4 * this.radius).addScaledVector(side[1], -1.8 * this.radius);
    sun.target.position.copy(this.centre);
    sun.castShadow = true;
    sun.shadow.mapSize.set(2048, 2048);
    const r = 1.25 * this.radius;
    Object.assign(sun.shadow.camera, { left: -r, right: r, top: r, bottom: -r, near: 0.01, far: 8 * this.radius });
    sun.shadow.normalBias = 0.004 * this.radius;
    sun.shadow.bias = -0.0006;
    sun.shadow.radius = 4;
    this.scene.add(sun, sun.target);
  }

  /** Two directions that span the table. */
  sideways() {
    const x = Math.abs(this.up.x) > 0.9 ? new Vector3(0, 1, 0) : new Vector3(1, 0, 0);
    x.addScaledVector(this.up, -x.dot(this.up)).normalize();
    return [x, new Vector3().crossVectors(this.up, x)];
  }

  table() {
    if (!this.data.support) return;
    const group = new Group();
    const point = new Vector3(...this.data.support);
    const foot = this.centre.clone().addScaledVector(this.up, point.sub(this.centre).dot(this.up));
    group.position.copy(foot);
    group.quaternion.setFromUnitVectors(new Vector3(0, 0, 1), this.up);
    const disc = new CircleGeometry(1.45 * this.radius, 96);
    const top = new Mesh(disc, new MeshBasicMaterial({ polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 2 }));
    const shade = new Mesh(disc, new ShadowMaterial({ opacity: 0.22, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 }));
    shade.receiveShadow = true;
    const grid = this.grid(1.45 * this.radius);
    shade.renderOrder = 1;
    group.add(top, grid, shade);
    this.onTheme((dark) => {
      top.material.color = new Color(dark ? 0x26292d : 0xf1eee7);
      grid.material.color = new Color(dark ? 0x383d43 : 0xdcd7cb);
      shade.material.opacity = dark ? 0.5 : 0.2;
    });
    this.scene.add(group);
  }

  /** Lines every 50 mm, clipped to a disc. */
  grid(radius) {
    const step = radius > 1.2 ? 0.25 : radius > 0.16 ? 0.05 : 0.01;
    const at = [];
    const last = Math.floor(radius / step);
    for (let i = -last; i <= last; i++) {
      const s = i * step;
      const half = Math.sqrt(Math.max(0, radius * radius - s * s));
      at.push(s, -half, 0, s, half, 0, -half, s, 0, half, s, 0);
    }
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(at), 3));
    return new LineSegments(geometry, new LineBasicMaterial());
  }

  /** Looks at everything: the least distance at which every corner is in the picture, then centred. */
  home() {
    const [x, y] = this.sideways();
    const towards = new Vector3().addScaledVector(y, -0.78).addScaledVector(x, 0.42).addScaledVector(this.up, 0.74).normalize();
    const right = new Vector3().crossVectors(this.up, towards).normalize();
    const above = new Vector3().crossVectors(towards, right);
    const high = Math.tan((this.camera.fov * Math.PI) / 360);
    const wide = high * this.camera.aspect;
    const target = this.centre.clone();
    let away = 3 * this.radius;
    for (let round = 0; round < 4; round++) {
      const seen = this.corners.map((c) => {
        const d = c.clone().sub(target);
        return [d.dot(right), d.dot(above), d.dot(towards)];
      });
      away = Math.max(...seen.map(([a, b, c]) => c + 1.12 * Math.max(Math.abs(a) / wide, Math.abs(b) / high)));
      const middle = (k) => {
        const at = seen.map((s) => s[k] / (away - s[2]));
        return ((Math.min(...at) + Math.max(...at)) / 2) * away;
      };
      target.addScaledVector(right, middle(0)).addScaledVector(above, middle(1));
    }
    this.camera.position.copy(target).addScaledVector(towards, away);
    this.controls.target.copy(target);
    this.controls.minDistance = 0.3 * this.radius;
    this.controls.maxDistance = 8 * this.radius;
    this.controls.update();
    this.draw();
  }

  /** Turns about the target; angles in radians. */
  turn(right, upwards, nearer = 1) {
    const away = this.camera.position.clone().sub(this.controls.target);
    const flat = new Quaternion().setFromUnitVectors(this.up, new Vector3(0, 1, 0));
    const ball = new Spherical().setFromVector3(away.applyQuaternion(flat));
    ball.theta += right;
    ball.phi = Math.min(Math.PI - 0.05, Math.max(0.05, ball.phi - upwards));
    ball.radius = Math.min(this.controls.maxDistance, Math.max(this.controls.minDistance, ball.radius * nearer));
    away.setFromSpherical(ball).applyQuaternion(flat.invert());
    this.camera.position.copy(this.controls.target).add(away);
    this.controls.update();
    this.draw();
  }

  keys() {
    const act = {
      ArrowLeft: () => this.turn(-0.12, 0), ArrowRight: () => this.turn(0.12, 0), ArrowUp: () => this.turn(0, 0.1),
      ArrowDown: () => this.turn(0, -0.1), '+': () => this.turn(0, 0, 0.88), '=': () => this.turn(0, 0, 0.88),
      '-': () => this.turn(0, 0, 1 / 0.88), 0: () => this.home(),
    };
    this.canvas.addEventListener('keydown', (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (this.onKey?.(event)) {
        event.preventDefault();
        return;
      }
      if (!act[event.key]) return;
      act[event.key]();
      event.preventDefault();
    });
    // The wheel scrolls the page until the scene is taken hold of; one finger up or down always does.
    this.controls.enableZoom = false;
    this.canvas.addEventListener('pointerdown', () => { this.controls.enableZoom = true; });
    this.canvas.addEventListener('focus', () => { this.controls.enableZoom = true; });
    this.canvas.addEventListener('blur', () => { this.controls.enableZoom = false; });
    this.canvas.style.touchAction = 'pan-y';
  }

  resize() {
    const width = Math.max(1, this.view.clientWidth);
    const height = Math.max(1, this.view.clientHeight);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  draw() {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      this.renderer.render(this.scene, this.camera);
      this.afterDraw?.();
    });
  }
}
