/** Rotation of each link relative to its parent, computed from poses, for files without joint angles. */
import type { Recording } from './recording';

/** A link's rotation since the start, about the axis of its largest rotation; degrees. */
export interface Turn {
  link: string;
  times: number[];
  degrees: number[];
}

const DEGREES = 180 / Math.PI;
type Four = [number, number, number, number];

/** conj(a) · b for unit quaternions x, y, z, w. */
function between([ax, ay, az, aw]: Four, [bx, by, bz, bw]: Four): Four {
  return [
    aw * bx - ax * bw - ay * bz + az * by,
    aw * by + ax * bz - ay * bw - az * bx,
    aw * bz - ax * by + ay * bx - az * bw,
    aw * bw + ax * bx + ay * by + az * bz,
  ];
}

/** The rotation vector of a unit quaternion, rad. */
function vector([x, y, z, w]: Four): [number, number, number] {
  const size = Math.hypot(x, y, z);
  if (size < 1e-12) return [0, 0, 0];
  const by = (2 * Math.atan2(w < 0 ? -size : size, Math.abs(w))) / size;
  return [x * by, y * by, z * by];
}

function quat(poses: Float32Array, row: number): Four {
  const at = 7 * row + 3;
  return [poses[at] ?? 0, poses[at + 1] ?? 0, poses[at + 2] ?? 0, poses[at + 3] ?? 1];
}

/** Rotations of all links except the base, largest first. */
export function turns({ poses, scene }: Recording): Turn[] {
  const times = [...poses.times];
  const links = scene.moving.flatMap((id, row) => {
    const body = scene.bodies.find((one) => one.id === id);
    const parent = poses.parents[row] ?? -1;
    return body?.kind === 'hand' && parent >= 0 ? [{ link: body.name, row, parent }] : [];
  });
  const found = links.map(({ link, row, parent }) => {
    const inParent = (time: number): Four => {
      const all = poses.at(time);
      return between(quat(all, parent), quat(all, row));
    };
    const start = inParent(times[0] ?? 0);
    const vectors = times.map((time) => vector(between(start, inParent(time))));
    const axis = vectors.reduce((most, one) => (Math.hypot(...one) > Math.hypot(...most) ? one : most), [0, 0, 0]);
    const size = Math.hypot(...axis) || 1;
    return {
      link,
      times,
      degrees: vectors.map((v) => ((v[0] * axis[0] + v[1] * axis[1] + v[2] * axis[2]) / size) * DEGREES),
      most: size * DEGREES,
    };
  });
  return found.sort((a, b) => b.most - a.most).map(({ link, times: t, degrees }) => ({ link, times: t, degrees }));
}
