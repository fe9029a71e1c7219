/** Names of bodies, as HTML text over the canvas. */
import { type Camera, Vector3 } from 'three';

/** Height of a label's line, CSS px. */
const LINE_PX = 19;

interface Label {
  element: HTMLElement;
  width: number;
  x: number;
  y: number;
  seen: boolean;
}

export class Labels {
  private readonly labels = new Map<number, Label>();
  private readonly at = new Vector3();
  /** A label that would be farther than this below its body is hidden, px. */
  private maxOffset = Infinity;

  constructor(private readonly container: HTMLElement) {}

  /** Labels these bodies; earlier labels are removed. */
  set(names: readonly { id: number; name: string }[], maxOffset = Infinity): void {
    this.clear();
    this.maxOffset = maxOffset;
    for (const { id, name } of names) {
      const element = document.createElement('span');
      element.className = 'stage-label';
      const isolated = document.createElement('bdi');
      isolated.textContent = name;
      element.append(isolated);
      this.container.append(element);
      this.labels.set(id, { element, width: 0, x: 0, y: 0, seen: true });
    }
    for (const label of this.labels.values()) label.width = label.element.offsetWidth;
  }

  clear(): void {
    for (const { element } of this.labels.values()) element.remove();
    this.labels.clear();
  }

  /** Moves each label to its body on the screen; overlapping labels move down. */
  place(camera: Camera, width: number, height: number, where: (id: number, into: Vector3) => Vector3 | null): void {
    if (this.labels.size === 0) return;
    const seen: Label[] = [];
    for (const [id, label] of this.labels) {
      const at = where(id, this.at)?.project(camera);
      label.seen = at !== undefined && at.z < 1 && Math.abs(at.x) < 1 && Math.abs(at.y) < 1;
      if (!at || !label.seen) {
        label.element.hidden = true;
        continue;
      }
      label.x = Math.max(0, Math.min(((at.x + 1) / 2) * width, width - label.width));
      label.y = ((1 - at.y) / 2) * height;
      seen.push(label);
    }
    seen.sort((a, b) => a.y - b.y);
    const placed: Label[] = [];
    seen.forEach((label) => {
      const own = label.y;
      for (const other of placed) {
        const beside = label.x > other.x + other.width || other.x > label.x + label.width;
        if (!beside && label.y < other.y + LINE_PX && label.y > other.y - LINE_PX) label.y = other.y + LINE_PX;
      }
      const near = label.y - own <= this.maxOffset;
      if (label.element.hidden === near) label.element.hidden = !near;
      if (!near) return;
      placed.push(label);
      label.element.style.transform = `translate(${Math.round(label.x)}px, ${Math.round(label.y)}px)`;
    });
  }
}
