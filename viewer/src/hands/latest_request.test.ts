import { describe, expect, it, vi } from 'vitest';
import { LatestRequest } from './latest_request';

const turn = (): Promise<void> => new Promise((resolve) => setTimeout(resolve, 0));

describe('the latest request', () => {
  it('is the next one, and those before it are skipped', async () => {
    const [sent, received]: [number[], number[]] = [[], []];
    const open: ((answer: number) => void)[] = [];
    const newest = new LatestRequest<number, number>(
      (question) => {
        sent.push(question);
        return new Promise((resolve) => open.push(resolve));
      },
      (answer) => received.push(answer),
      () => undefined,
    );
    for (const question of [1, 2, 3, 4]) newest.put(question);
    await turn();
    expect(sent).toEqual([1]);
    open[0]?.(10);
    await turn();
    expect(sent).toEqual([1, 4]);
    open[1]?.(40);
    await turn();
    expect(received).toEqual([10, 40]);
    newest.put(5);
    await turn();
    expect(sent).toEqual([1, 4, 5]);
  });

  it('is sent after a failure, too', async () => {
    const failed = vi.fn();
    const newest = new LatestRequest<number, number>(
      (question) => (question === 1 ? Promise.reject(new Error('no')) : Promise.resolve(question)),
      () => undefined,
      failed,
    );
    newest.put(1);
    newest.put(2);
    await turn();
    expect(failed).toHaveBeenCalledTimes(1);
    expect(newest.count).toBe(1);
  });

  it('is repeated while the server is busy', async () => {
    vi.useFakeTimers();
    let sent = 0;
    const newest = new LatestRequest<number, number>(
      (question) => {
        sent += 1;
        return sent === 1 ? Promise.reject(new Error('full')) : Promise.resolve(question);
      },
      () => undefined,
      () => undefined,
      () => true,
    );
    newest.put(1);
    await vi.advanceTimersByTimeAsync(1000);
    vi.useRealTimers();
    expect([sent, newest.count]).toEqual([2, 1]);
  });
});
