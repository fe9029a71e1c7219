/** Reads the two protobuf messages of a replay: `foxglove.FrameTransforms` (/tf) and `palmares.Telemetry` (/telemetry). */
import { PbfReader } from 'pbf';

/** Pose of a frame in its parent: position in m, unit quaternion x, y, z, w. */
export interface FrameTransform {
  parent: string;
  child: string;
  pose: number[];
}

/** State and sensors of the hand at a moment; angles in rad, forces in N, tension in the tendon's unit. */
export interface TelemetryRecord {
  tick: number;
  score: number;
  command: number[];
  position: number[];
  motorTension: number[];
  tension: number[];
  q: number[];
  predicted: number[];
  contactA: number[];
  contactB: number[];
  contactPosition: number[];
  contactForce: number[];
  contactUse: number[];
  work: number[];
  fingerForce: number[];
  fingerTorque: number[];
  touch: number[];
  readings: number[];
}

type Numbers = number[];

const xyz = (field: number, into: Numbers, pbf: PbfReader): void => {
  if (field <= 4) into[field - 1] = pbf.readDouble();
};

const readTransform = (field: number, found: FrameTransform, pbf: PbfReader): void => {
  if (field === 2) found.parent = pbf.readString();
  else if (field === 3) found.child = pbf.readString();
  else if (field === 4) found.pose.splice(0, 3, ...pbf.readMessage(xyz, [0, 0, 0]));
  else if (field === 5) found.pose.splice(3, 4, ...pbf.readMessage(xyz, [0, 0, 0, 0]));
};

/** The transforms of one message. */
export function frameTransforms(data: Uint8Array): FrameTransform[] {
  const read = (field: number, all: FrameTransform[], pbf: PbfReader): void => {
    if (field === 1) all.push(pbf.readMessage(readTransform, { parent: '', child: '', pose: [0, 0, 0, 0, 0, 0, 1] }));
  };
  return new PbfReader(data).readFields(read, []);
}

const readTelemetry = (field: number, record: TelemetryRecord, pbf: PbfReader): void => {
  switch (field) {
    case 2: record.tick = pbf.readVarint(); break;
    case 3: record.score = pbf.readDouble(); break;
    case 4: pbf.readPackedFloat(record.command); break;
    case 5: pbf.readPackedFloat(record.position); break;
    case 6: pbf.readPackedFloat(record.motorTension); break;
    case 7: pbf.readPackedFloat(record.tension); break;
    case 8: pbf.readPackedFloat(record.q); break;
    case 9: pbf.readPackedFloat(record.predicted); break;
    case 10: pbf.readPackedVarint(record.contactA); break;
    case 11: pbf.readPackedVarint(record.contactB); break;
    case 12: pbf.readPackedFloat(record.contactPosition); break;
    case 13: pbf.readPackedFloat(record.contactForce); break;
    case 14: pbf.readPackedFloat(record.contactUse); break;
    case 15: pbf.readPackedFloat(record.work); break;
    case 16: pbf.readPackedFloat(record.fingerForce); break;
    case 17: pbf.readPackedFloat(record.fingerTorque); break;
    case 18: pbf.readPackedFloat(record.touch); break;
    case 19: pbf.readPackedFloat(record.readings); break;
  }
};

/** One message of /telemetry. */
export function telemetry(data: Uint8Array): TelemetryRecord {
  return new PbfReader(data).readFields(readTelemetry, {
    tick: 0, score: 0, command: [], position: [], motorTension: [], tension: [], q: [], predicted: [],
    contactA: [], contactB: [], contactPosition: [], contactForce: [], contactUse: [],
    work: [], fingerForce: [], fingerTorque: [], touch: [], readings: [],
  });
}
