/** `palmares.Telemetry`, derived from docs/schema: `cargo xtask generate` writes it. */
export interface TelemetryRecord {
  tick: number;
  score: number;
  command: number[];
  position: number[];
  motor_tension: number[];
  tension: number[];
  q: number[];
  predicted: number[];
  contact_a: number[];
  contact_b: number[];
  contact_position: number[];
  contact_force: number[];
  contact_use: number[];
  work: number[];
  finger_force: number[];
  finger_torque: number[];
  touch: number[];
  readings: number[];
}

/** Its fields by number. */
export const TELEMETRY_FIELDS = {
  2: { name: 'tick', type: 'uint64', repeated: false },
  3: { name: 'score', type: 'double', repeated: false },
  4: { name: 'command', type: 'float', repeated: true },
  5: { name: 'position', type: 'float', repeated: true },
  6: { name: 'motor_tension', type: 'float', repeated: true },
  7: { name: 'tension', type: 'float', repeated: true },
  8: { name: 'q', type: 'float', repeated: true },
  9: { name: 'predicted', type: 'float', repeated: true },
  10: { name: 'contact_a', type: 'uint32', repeated: true },
  11: { name: 'contact_b', type: 'uint32', repeated: true },
  12: { name: 'contact_position', type: 'float', repeated: true },
  13: { name: 'contact_force', type: 'float', repeated: true },
  14: { name: 'contact_use', type: 'float', repeated: true },
  15: { name: 'work', type: 'float', repeated: true },
  16: { name: 'finger_force', type: 'float', repeated: true },
  17: { name: 'finger_torque', type: 'float', repeated: true },
  18: { name: 'touch', type: 'float', repeated: true },
  19: { name: 'readings', type: 'float', repeated: true },
} as const;
