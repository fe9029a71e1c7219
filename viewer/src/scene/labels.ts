/** Names of bodies, as text above the picture. */
import { type Camera, Vector3 } from 'three';

export class Labels {
  private readonly labels = new Map<number, HTMLElement>();
  private readonly at = new Vector3();

  constructor(private readonly container: HTMLElement) {}

  /** Labels for bodies by id; others go. */
  set(names: readonly { id: number; name: string }[]): void {
    this.clear();
    for (const { id, name } of names) {
      const label = document.createElement('span');
      label.className = 'stage-label';
      const isolated = document.createElement('bdi');
      isolated.textContent = name;
      label.append(isolated);
      this.container.append(label);
      this.labels.set(id, label);
    }
  }

  clear(): void {
    for (const label of this.labels.values()) label.remove();
    this.labels.clear();
  }

  /** Puts every label where its body is on the screen. */
  place(camera: Camera, width: number, height: number, where: (id: number, into: Vector3) => Vector3 | null): void {
    for (const [id, label] of this.labels) {
      const at = where(id, this.at)?.project(camera);
      const seen = at !== undefined && at.z < 1 && Math.abs(at.x) < 1 && Math.abs(at.y) < 1;
      label.hidden = !seen;
      if (seen) label.style.transform = `translate(${((at.x + 1) / 2) * width}px, ${((1 - at.y) / 2) * height}px)`;
    }
  }
}
