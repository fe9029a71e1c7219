import { Vector3 } from 'three';
import { describe, expect, it } from 'vitest';
import { Axes, Bounds, type Pane, type Place } from './framing';

const TAN = Math.tan(Math.PI / 8);
const pane: Pane = { left: 0.9, right: 0.9, top: 0.9, bottom: 0.7 };
const points = [new Vector3(0.3, 0.1, 0), new Vector3(-0.2, 0.4, 0.3), new Vector3(0.5, -0.6, 0.1), new Vector3(0, 0, 0.9)];

/** Where points are between the middle (0) and the pane's edges (1). */
function filled(axes: Axes, place: Place, aspect: number): { sides: number[]; near: number } {
  const all = points.map((point) => {
    const at = axes.placeOf(point);
    const away = place.depth - at.depth;
    return { x: (at.across - place.across) / (away * TAN * aspect), y: (at.up - place.up) / (away * TAN), away };
  });
  const most = (of: (p: { x: number; y: number }) => number): number => Math.max(...all.map(of));
  return {
    sides: [most((p) => p.x / pane.right), most((p) => -p.x / pane.left), most((p) => p.y / pane.top), most((p) => -p.y / pane.bottom)],
    near: Math.min(...all.map(({ away }) => away)),
  };
}

describe('the camera that fits points', () => {
  it('has all of them in its pane, which they fill in one direction', () => {
    for (const aspect of [0.6, 1.27, 2.5])
      for (const towards of [new Vector3(0.55, -1, 0.7), new Vector3(0, -0.001, 1), new Vector3(-1, 0.2, -0.3)]) {
        const axes = new Axes(towards);
        const { sides, near } = filled(axes, new Bounds(axes, pane, TAN, aspect).add(points).fit(), aspect);
        const [right = 0, left = 0, top = 0, bottom = 0] = sides;
        expect(Math.max(...sides)).toBeLessThan(1 + 1e-9);
        expect(Math.max(right + left, top + bottom)).toBeCloseTo(2, 9);
        expect(near).toBeGreaterThan(0.09);
      }
  });

  it('moves no farther than it must', () => {
    const axes = new Axes(new Vector3(0.55, -1, 0.7));
    const bounds = new Bounds(axes, pane, TAN, 1.3).add(points);
    const fit = bounds.fit();
    const behind = { ...fit, depth: fit.depth + 1 };
    expect(bounds.nearest(behind)).toEqual(behind);
    const aside = { ...behind, across: behind.across + 5 };
    const moved = bounds.nearest(aside);
    expect([moved.up, moved.depth]).toEqual([aside.up, aside.depth]);
    expect(filled(axes, moved, 1.3).sides[1]).toBeCloseTo(1, 9);
    expect(bounds.nearest({ across: 0, up: 0, depth: -3 }).depth).toBeCloseTo(fit.depth, 9);
  });
});
