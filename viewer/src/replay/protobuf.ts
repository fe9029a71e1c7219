/** Reads the two protobuf messages of a replay: `foxglove.FrameTransforms` (/tf) and `palmares.Telemetry` (/telemetry). */
import { PbfReader } from 'pbf';
import { TELEMETRY_FIELDS, type TelemetryRecord } from '../wire/telemetry';

/** Pose of a frame in its parent: position in m, unit quaternion x, y, z, w. */
export interface FrameTransform {
  parent: string;
  child: string;
  pose: number[];
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

const readTelemetry = (number: number, record: TelemetryRecord, pbf: PbfReader): void => {
  const field = number in TELEMETRY_FIELDS ? TELEMETRY_FIELDS[number as keyof typeof TELEMETRY_FIELDS] : undefined;
  if (field?.repeated === false) record[field.name] = field.type === 'double' ? pbf.readDouble() : pbf.readVarint();
  else if (field?.type === 'float') pbf.readPackedFloat(record[field.name]);
  else if (field) pbf.readPackedVarint(record[field.name]);
};

/** One message of /telemetry. */
export function telemetry(data: Uint8Array): TelemetryRecord {
  return new PbfReader(data).readFields(readTelemetry, emptyRecord());
}

/** A record without numbers. */
export function emptyRecord(): TelemetryRecord {
  const fields = Object.values(TELEMETRY_FIELDS).map((field) => [field.name, field.repeated ? [] : 0]);
  return Object.fromEntries(fields) as TelemetryRecord;
}
