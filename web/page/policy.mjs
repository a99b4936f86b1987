// The Content-Security-Policy of the page, and of its workers, which take it only from the headers of their own files.

export const POLICY = [
  "default-src 'none'", "script-src 'self' 'wasm-unsafe-eval'", "worker-src 'self'", "connect-src 'self'", "style-src 'self'", "img-src 'self' data: blob:",
  "base-uri 'none'", "form-action 'none'",
].join('; ');
