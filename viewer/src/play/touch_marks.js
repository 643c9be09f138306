// What shows a hand at work: the point that is held with a line to where the hand wants it, the fingertip, the thing chosen.
import { BufferGeometry, Float32BufferAttribute, Line, LineBasicMaterial, Mesh, MeshBasicMaterial, SphereGeometry } from 'three';
import { Finger, FINGER } from './hand.js';

const COLOR = 0xd55e00;
const GLOW = 0x3a2410;

export class TouchMarks {
  constructor(stage, sim, links) {
    Object.assign(this, { stage, sim, links });
    const over = { color: COLOR, transparent: true, depthTest: false };
    this.ball = new Mesh(new SphereGeometry(0.011 * stage.radius, 20, 14), new MeshBasicMaterial({ ...over, opacity: 0.95 }));
    this.tip = new Mesh(new SphereGeometry(FINGER, 24, 16), new MeshBasicMaterial({ color: COLOR }));
    const line = new BufferGeometry();
    line.setAttribute('position', new Float32BufferAttribute(6, 3));
    this.line = new Line(line, new LineBasicMaterial(over));
    this.line.frustumCulled = false;
    [this.ball, this.line].forEach((o) => { o.renderOrder = 8; });
    stage.scene.add(this.ball, this.tip, this.line);
    this.update();
  }

  update() {
    const [hand] = this.sim.hands.filter((h) => !h.aside).slice(-1);
    const finger = hand instanceof Finger;
    this.tip.visible = Boolean(hand) && finger;
    this.ball.visible = this.line.visible = Boolean(hand) && !finger;
    if (finger) this.tip.position.copy(hand.point);
    else if (hand) {
      const point = hand.point;
      this.ball.position.copy(point);
      const at = this.line.geometry.getAttribute('position');
      at.setXYZ(0, ...point.toArray());
      at.setXYZ(1, ...hand.goal.toArray());
      at.needsUpdate = true;
    }
    const held = hand?.part?.data.link;
    for (const link of this.links) link.mesh?.material.emissive.setHex(link.data.name === held ? GLOW : 0);
  }
}
