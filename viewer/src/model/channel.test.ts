import { expect, it } from 'vitest';
import { type Channel, readingsOf } from './channel';

const wrist: Channel = {
  name: 'wrist',
  shape: [6],
  columns: [
    { name: 'force', width: 3, unit: 'N' },
    { name: 'torque', width: 3, unit: 'N·m' },
  ],
  description: '',
};
const temperature: Channel = { name: 'temperature', shape: [2], columns: [{ width: 1, unit: '°C' }], description: '' };
const slip: Channel = {
  name: 'slip',
  shape: [2, 3],
  columns: [
    { name: 'along', width: 2, unit: 'm' },
    { name: 'turn', width: 1, unit: 'rad' },
  ],
  description: '',
};

it('cuts a row of readings into the columns of its channels', () =>
  expect(readingsOf([wrist, temperature, slip], [1, 2, 3, 4, 5, 6, 20, 21, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6])).toEqual([
    { label: 'wrist, force', unit: 'N', numbers: [1, 2, 3] },
    { label: 'wrist, torque', unit: 'N·m', numbers: [4, 5, 6] },
    { label: 'temperature', unit: '°C', numbers: [20, 21] },
    { label: 'slip, along', unit: 'm', numbers: [0.1, 0.2, 0.4, 0.5] },
    { label: 'slip, turn', unit: 'rad', numbers: [0.3, 0.6] },
  ]));

it('has no numbers where a row is missing', () =>
  expect(readingsOf([temperature], [])).toEqual([{ label: 'temperature', unit: '°C', numbers: [] }]));
