/// What the standard library of Debian's emscripten lacks of C++20. It is included before everything else.
#pragma once

#include <atomic>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <system_error>

namespace std {

template <class T>
struct atomic_ref {
    explicit atomic_ref(T& value) : value_(&value) {}
    void store(T desired, memory_order order) const {
        __atomic_store_n(value_, desired, static_cast<int>(order));
    }

  private:
    T* value_;
};

template <class To, class From>
constexpr To bit_cast(const From& from) noexcept {
    return __builtin_bit_cast(To, from);
}

/// The shortest text that reads back as the same value, without an exponent where that is not longer.
inline to_chars_result to_chars(char* first, char* last, float value) {
    char text[64];
    for (int digits = 1; digits <= 9; ++digits) {
        snprintf(text, sizeof text, "%.*e", digits - 1, static_cast<double>(value));
        if (!isfinite(value)) break;
        if (strtof(text, nullptr) != value) continue;
        const int exponent = atoi(strchr(text, 'e') + 1);
        const int places = max(0, digits - 1 - exponent);
        char fixed[64];
        if (exponent > 16) break;
        snprintf(fixed, sizeof fixed, "%.*f", places, static_cast<double>(value));
        if (strlen(fixed) <= strlen(text)) memcpy(text, fixed, sizeof text);
        break;
    }
    const size_t size = strlen(text);
    if (last - first < static_cast<ptrdiff_t>(size)) return {last, errc::value_too_large};
    memcpy(first, text, size);
    return {first + size, errc{}};
}

/// Decimal numbers as from_chars takes them: without white space, a leading plus or hexadecimal digits.
inline from_chars_result from_chars(const char* first, const char* last, double& value) {
    const string text(first, last);
    const char* const digits = text.c_str() + (text[0] == '-');
    const bool hexadecimal = digits[0] == '0' && (digits[1] | 0x20) == 'x';
    const char c = digits[0];
    if (!(c >= '0' && c <= '9') && c != '.' && (c | 0x20) != 'i' && (c | 0x20) != 'n')
        return {first, errc::invalid_argument};
    if (hexadecimal) {  // only its zero is a decimal number
        value = text[0] == '-' ? -0.0 : 0.0;
        return {first + (digits - text.c_str()) + 1, errc{}};
    }
    char* end = nullptr;
    const double read = strtod(text.c_str(), &end);
    if (end == text.c_str()) return {first, errc::invalid_argument};
    if (abs(read) == HUGE_VAL && (c | 0x20) != 'i')
        return {first + (end - text.c_str()), errc::result_out_of_range};
    value = read;
    return {first + (end - text.c_str()), errc{}};
}

}  // namespace std
