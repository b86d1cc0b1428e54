#include "core/base/number.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* "1e-07" -> "1e-7", "1e+20" -> "1e20": printf pads exponents, JSON need not. */
static size_t
trim_exponent(char *text)
{
    char *e = strchr(text, 'e');
    if (e == NULL)
        return strlen(text);
    char *to = e + 1;
    const char *from = e + 1;
    if (*from == '-')
        *to++ = *from++;
    else if (*from == '+')
        from++;
    while (*from == '0' && from[1] != '\0')
        from++;
    memmove(to, from, strlen(from) + 1);
    return strlen(text);
}

static bool
reads_back(const char *text, double number)
{
    return strtod(text, NULL) == number;
}

/* Whole numbers below 1e15 are exact and by far the commonest. */
static size_t
whole_text(int64_t whole, char text[NUMBER_SIZE])
{
    char reversed[NUMBER_SIZE];
    size_t len = 0, at = 0;
    uint64_t rest = whole < 0 ? (uint64_t)-whole : (uint64_t)whole;
    do {
        reversed[len++] = (char)('0' + rest % 10);
        rest /= 10;
    } while (rest > 0);
    if (whole < 0)
        text[at++] = '-';
    while (len > 0)
        text[at++] = reversed[--len];
    text[at] = '\0';
    return at;
}

static bool
is_power_of_two(double number)
{
    uint64_t bits;
    memcpy(&bits, &number, sizeof bits);
    return (bits & UINT64_C(0xfffffffffffff)) == 0;
}

/* Above a power of two the doubles lie twice as far apart as below it: the
 * nearest 16 digits may fall short while the next ones, farther from zero,
 * still read back. */
static bool
next_sixteen(double number, char text[NUMBER_SIZE])
{
    snprintf(text, NUMBER_SIZE, "%.15e", number);
    char *digit = strchr(text, 'e') - 1;
    while (*digit == '9' || *digit == '.') {
        if (*digit == '9')
            *digit = '0';
        if (digit == text || digit[-1] == '-')
            return false;
        digit--;
    }
    ++*digit;
    return reads_back(text, number);
}

size_t
number_text(double number, char text[NUMBER_SIZE])
{
    if (number == 0) {
        memcpy(text, "0", 2);
        return 1;
    }
    if (number > -1e15 && number < 1e15 && (double)(int64_t)number == number)
        return whole_text((int64_t)number, text);

    /* Subnormal numbers have fewer digits: the first that read back. */
    if (number > -2.3e-308 && number < 2.3e-308) {
        int digits = 1;
        do
            snprintf(text, NUMBER_SIZE, "%.*g", digits, number);
        while (!reads_back(text, number) && ++digits <= 17);
        return trim_exponent(text);
    }

    /* Any decimal of up to 15 digits survives the way to double and back, so
     * if one of them is this number, 15 digits show it, and %g drops the
     * zeros behind it. */
    snprintf(text, NUMBER_SIZE, "%.15g", number);
    if (reads_back(text, number))
        return trim_exponent(text);
    snprintf(text, NUMBER_SIZE, "%.16g", number);
    if (reads_back(text, number))
        return trim_exponent(text);

    if (is_power_of_two(number) && next_sixteen(number, text))
        return trim_exponent(text);
    snprintf(text, NUMBER_SIZE, "%.17g", number);
    return trim_exponent(text);
}
