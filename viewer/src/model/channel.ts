/** A channel of a hand: numbers that its sensors read, as the server and replays describe them. */
export interface Channel {
  name: string;
  shape: number[];
  /** Along the last axis of the shape. */
  columns: { name?: string; width: number; unit: string }[];
  description: string;
}

/** A column of a channel with its numbers, row after row. */
export interface Reading {
  label: string;
  unit: string;
  numbers: number[];
}

/** The readings of each channel, column by column. */
export function readingsOf(channels: readonly Channel[], row: readonly number[]): Reading[] {
  let begin = 0;
  return channels.flatMap(({ name, shape, columns }) => {
    const count = shape.reduce((product, length) => product * length, 1);
    const numbers = row.slice(begin, begin + count);
    begin += count;
    const width = columns.reduce((sum, column) => sum + column.width, 0);
    let first = 0;
    return columns.map((column) => {
      const from = first;
      first += column.width;
      const own = numbers.filter((_, k) => k % width >= from && k % width < from + column.width);
      return { label: column.name ? `${name}, ${column.name}` : name, unit: column.unit, numbers: own };
    });
  });
}
