// Distances between two positions in the patient.
import { rounded } from './dom';
import type { Vec3 } from './scan/geometry';
import { length, sub } from './scan/geometry';
import type { Distance } from './state';

export const distanceText = ({ from, to }: Distance): string => `${rounded(length(sub(to, from)))} mm`;
export const midpoint = (a: Vec3, b: Vec3): Vec3 => [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2];
