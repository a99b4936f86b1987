// Float operations that give the bits of IEEE 754 on every device, or say that they might not.
//
// Vulkan promises correctly rounded +, - and * of normal numbers, but neither denormals nor infinities, and division
// and square root are only close. So these two are computed in integers, and `unsafe` is set where an operand or a
// result might be denormal or overflow. Every result is `precise`, so that nothing is fused.
#ifndef MARROW_ARITHMETIC_GLSL
#define MARROW_ARITHMETIC_GLSL
#extension GL_EXT_control_flow_attributes : require

bool unsafe = false;

bool is_zero(float v) {
    return (floatBitsToUint(v) & 0x7fffffffu) == 0u;
}
int exponent(float v) {
    return int(floatBitsToUint(v) >> 23 & 255u) - 127;
}
float negated(float v) {
    return uintBitsToFloat(floatBitsToUint(v) ^ 0x80000000u);
}
float magnitude(float v) {
    return uintBitsToFloat(floatBitsToUint(v) & 0x7fffffffu);
}
void forbid_denormal(float v) {
    if (exponent(v) == -127 && !is_zero(v)) unsafe = true;
}

float mul(float a, float b) {
    forbid_denormal(a);
    forbid_denormal(b);
    const int e = exponent(a) + exponent(b);
    if (!is_zero(a) && !is_zero(b) && (e < -126 || e > 125)) unsafe = true;
    precise float product = a * b;
    return product;
}

float add(float a, float b) {
    forbid_denormal(a);
    forbid_denormal(b);
    const int e = max(exponent(a), exponent(b));
    // The sum of small numbers can be denormal only if they nearly cancel.
    if (e > 126 || (!is_zero(a) && !is_zero(b) && e < -100)) unsafe = true;
    precise float sum = a + b;
    return sum;
}

float sub(float a, float b) {
    return add(a, negated(b));
}

// By long division, one bit at a time, rounded to nearest even.
float div(float a, float b) {
    forbid_denormal(a);
    const uint ua = floatBitsToUint(a), ub = floatBitsToUint(b), sign = (ua ^ ub) & 0x80000000u;
    if (is_zero(a)) return uintBitsToFloat(sign);
    int e = exponent(a) - exponent(b) + 127;
    uint remainder = ua & 0x7fffffu | 0x800000u, quotient = 0u;
    const uint divisor = ub & 0x7fffffu | 0x800000u;
    if (remainder < divisor) {
        remainder <<= 1;
        --e;
    }
    if (e < 1 || e > 253) unsafe = true;
    for (int k = 0; k < 25; ++k) {
        quotient <<= 1;
        if (remainder >= divisor) {
            remainder -= divisor;
            quotient |= 1u;
        }
        remainder <<= 1;
    }
    const uint rounded = (quotient >> 1) + (quotient & 1u & (uint(remainder != 0u) | quotient >> 1));
    return uintBitsToFloat(sign | (uint(e) << 23) + (rounded - 0x800000u));
}

// Digit by digit, rounded to nearest even. a is normal and positive.
float square_root(float a) {
    const uint u = floatBitsToUint(a);
    const int e = exponent(a);
    uint digits = (u & 0x7fffffu | 0x800000u) << (7 + (e & 1)), root = 0u, remainder = 0u;
    for (int k = 0; k < 25; ++k) {
        remainder = remainder << 2 | digits >> 30;
        digits <<= 2;
        const uint next = root << 2 | 1u;
        root <<= 1;
        if (remainder >= next) {
            remainder -= next;
            root |= 1u;
        }
    }
    const uint rounded = (root >> 1) + (root & 1u & (uint(remainder != 0u) | root >> 1));
    return uintBitsToFloat((uint((e >> 1) + 127) << 23) + (rounded - 0x800000u));
}

// The sum of the squares. Squares below 2^-126, which are denormal, are dropped. The sum must then be at least 2^-76,
// so that they do not change it: what decides how it is rounded is near half of its last place, and so large that
// adding them to it has no effect. Without such squares, 2^-100 suffices.
float sum_of_squares(vec3 v) {
    float squares[3];
    bool dropped = false;
    [[unroll]] for (int r = 0; r < 3; ++r) {
        precise float square = v[r] * v[r];
        if (exponent(v[r]) > 61) unsafe = true;
        const bool small = exponent(v[r]) < -63;
        dropped = dropped || small && !is_zero(v[r]);
        squares[r] = small ? 0.0 : square;
    }
    precise float two = squares[0] + squares[1];
    precise float three = two + squares[2];
    if (exponent(three) < (dropped ? -76 : -100)) unsafe = true;
    return three;
}

#endif
