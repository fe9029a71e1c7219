"""Steps one MuJoCo model on request. Frames of 64-bit floats over standard input and output.

Start: 8 bytes of length and an MJCF document; answered by one float (1: it compiled) and the sizes nq, nv, nu,
or by 0, a length and a message. Then, each led by one byte:

    P  qpos, qvel          set the state; no answer
    B  on                  turn the base servo on (1) or off (0); no answer
    F  count, rows         the forces from outside in the steps that follow, a row each: number of the link, point in its
                           frame, force in the world's axes; no answer
    S  ctrl                one step; answered by CPU seconds, deepest overlap, warnings, qpos, qvel, actuator forces
    C                      answered by the number of contacts of the last step, and of each: numbers in the names of both
                           shapes, place, normal from the first to the second, force on the second, gap
    R  longest             play everything since the start again, for at most so many CPU seconds; answered by CPU
                           seconds per step, without multiccd where the run is the same and faster without

CPU time is that of this thread around mj_step alone, less what reading the clock and calling MuJoCo cost.
"""

import copy
import struct
import sys
import time

import mujoco
import numpy as np

clock = time.thread_time_ns


def read(stream, count):
    data = stream.read(count)
    if len(data) != count:
        sys.exit(0)
    return data


def floats(stream, count):
    return np.frombuffer(read(stream, 8 * count))


def overhead_ns():
    spent = []
    for _ in range(2000):
        start = clock()
        mujoco.mj_version()
        spent.append(clock() - start)
    return sorted(spent)[len(spent) // 2]


class Base:
    """The servo of the base: the gains and biases of its six actuators, the first of a document."""

    def __init__(self, model):
        self.gain, self.bias = model.actuator_gainprm[:6].copy(), model.actuator_biasprm[:6].copy()

    def turn(self, model, on):
        model.actuator_gainprm[:6], model.actuator_biasprm[:6] = on * self.gain, on * self.bias


def push(model, data, rows):
    """Applies forces from outside, each as force and torque at the centre of mass of its body."""
    data.xfrc_applied[:] = 0
    mujoco.mj_kinematics(model, data)
    for row in rows:
        body = model.body(f"link{int(row[0])}").id
        at = data.xpos[body] + data.xmat[body].reshape(3, 3) @ row[1:4]
        data.xfrc_applied[body] += np.concatenate([row[4:], np.cross(at - data.xipos[body], row[4:])])


def played(model, base, start, log, longest_ns):
    """CPU time of the same run in one tight loop, ns, the number of its steps, and its last state."""
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = start
    ctrl, step = data.ctrl, mujoco.mj_step
    total = count = 0
    forces, loaded = (), False
    base.turn(model, 1.0)
    for op, values in log:
        if op == b"S":
            ctrl[:] = values
            if loaded:
                push(model, data, forces)
            begin = clock()
            step(model, data)
            total += clock() - begin
            count += 1
            if total > longest_ns:
                break
        elif op == b"B":
            loaded = True
            base.turn(model, values)
        elif op == b"F":
            forces, loaded = values, True
        else:
            data.qpos[:] = values[: model.nq]
            data.qvel[:] = values[model.nq :]
    return total, count, np.concatenate([data.qpos, data.qvel])


def replay(model, base, start, log, longest_ns):
    """CPU seconds per step of the same run; without multiccd, where it then ends bit for bit the same and sooner."""
    total, count, end = played(model, base, start, log, longest_ns)
    without = copy.copy(model)
    without.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_MULTICCD
    if without.opt.disableflags != model.opt.disableflags:
        steps = log_of(log, count)
        lesser, _, same = played(without, base, start, steps, 2 * longest_ns)
        if np.array_equal(end, same):
            total = min(total, lesser)
    return (total / max(count, 1) - OVERHEAD_NS) * 1e-9


def log_of(log, count):
    """The part of a log up to its step of this number."""
    for at, (op, _) in enumerate(log):
        count -= op == b"S"
        if count == 0:
            return log[: at + 1]
    return log


def contacts(model, data):
    """Every touching contact: shapes, place, normal, force in the world's axes, gap."""
    rows = []
    wrench = np.zeros(6)
    for k in range(data.ncon):
        contact = data.contact[k]
        if contact.efc_address < 0:
            continue
        mujoco.mj_contactForce(model, data, k, wrench)
        frame = contact.frame.reshape(3, 3)
        names = [int(model.geom(geom).name[1:]) for geom in contact.geom]
        rows.append([*names, *contact.pos, *frame[0], *(frame.T @ wrench[:3]), contact.dist])
    return np.array(rows)


def main():
    source, sink = sys.stdin.buffer, sys.stdout.buffer

    def answer(*parts):
        sink.write(np.concatenate([np.atleast_1d(part) for part in parts]).astype(float).tobytes())
        sink.flush()

    (length,) = struct.unpack("<Q", read(source, 8))
    document = read(source, length).decode()
    try:
        model = mujoco.MjModel.from_xml_string(document)
    except ValueError as error:
        message = str(error).encode()
        sink.write(struct.pack("<dd", 0.0, len(message)) + message)
        sink.flush()
        return
    data = mujoco.MjData(model)
    start = (data.qpos.copy(), data.qvel.copy())
    log = []
    base, forces, loaded = Base(model), (), False
    answer(1.0, model.nq, model.nv, model.nu)
    while True:
        op = read(source, 1)
        if op == b"P":
            values = floats(source, model.nq + model.nv)
            data.qpos[:] = values[: model.nq]
            data.qvel[:] = values[model.nq :]
            log.append((op, values))
        elif op == b"B":
            (on,) = floats(source, 1)
            base.turn(model, on)
            log.append((op, on))
        elif op == b"F":
            (count,) = floats(source, 1)
            forces, loaded = floats(source, 7 * int(count)).reshape(-1, 7), True
            log.append((op, forces))
        elif op == b"S":
            values = floats(source, model.nu)
            data.ctrl[:] = values
            if loaded:
                push(model, data, forces)
            log.append((op, values))
            begin = clock()
            mujoco.mj_step(model, data)
            spent = (clock() - begin - OVERHEAD_NS) * 1e-9
            overlap = max(0.0, -data.contact.dist.min()) if data.ncon else 0.0
            warnings = sum(warning.number for warning in data.warning)
            answer(spent, overlap, warnings, data.qpos, data.qvel, data.actuator_force)
        elif op == b"C":
            found = contacts(model, data)
            answer(len(found), found.ravel())
        elif op == b"R":
            (longest,) = floats(source, 1)
            answer(replay(model, base, start, log, longest * 1e9))


# The count of warnings shows a diverging run; thousands of lines about it help nobody.
mujoco.set_mju_user_warning(lambda message: None)
OVERHEAD_NS = overhead_ns()
main()
