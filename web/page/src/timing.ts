// Marks in the browser's own timeline, to measure the page by.

/** Notes that something happened now; only the newest of a name is kept. */
export function mark(name: 'open' | 'surface drawn'): void {
  performance.clearMarks(name);
  performance.mark(name);
}
