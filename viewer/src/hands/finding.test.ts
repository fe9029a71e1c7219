import { expect, it } from 'vitest';
import { finding, findings } from './finding';

it('splits a refusal', () =>
  expect(
    finding(
      "hand.zip/hand.urdf: link 'left_proximal': a shape's sizes are not positive: Capsule { radius: -1.0 }; valid: positive finite sizes, rounding at most the half extents",
    ),
  ).toEqual({
    file: 'hand.zip/hand.urdf',
    element: "link 'left_proximal'",
    text: "a shape's sizes are not positive: Capsule { radius: -1.0 }",
    valid: 'valid: positive finite sizes, rounding at most the half extents',
  }));

it('splits a warning', () =>
  expect(finding("pinch/hand.urdf: actuator 'close_motor': no [motors] entry: taken are scaling 7, speed limit 2/s")).toEqual({
    file: 'pinch/hand.urdf',
    element: "actuator 'close_motor'",
    text: 'no [motors] entry: taken are scaling 7, speed limit 2/s',
    valid: null,
  }));

it('keeps a message without an element', () => {
  expect(finding('hand.zip: not valid ZIP: invalid Zip archive')).toEqual({
    file: 'hand.zip',
    element: null,
    text: 'not valid ZIP: invalid Zip archive',
    valid: null,
  });
  expect(finding('name the team of the hand: ?team=name').text).toBe('name the team of the hand: ?team=name');
});

it('splits several messages at line ends', () => expect(findings('a\n\nb\n').map((one) => one.text)).toEqual(['a', 'b']));
