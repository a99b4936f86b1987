// The error that all promises of the package reject with.

export class MarrowError extends Error {
  constructor(message, code) {
    super(message);
    this.name = 'MarrowError';
    this.code = code;
  }
}

export const cancelled = () => new MarrowError('cancelled', 130);
