#include "core/base/ulid.h"

#include <sodium.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "core/base/clock.h"

static const char digits[] = "0123456789ABCDEFGHJKMNPQRSTVWXYZ";

void
ulid_id(const char *kind, char id[ID_SIZE])
{
    char text[ULID_SIZE];
    uint64_t time = (uint64_t)clock_wall_ms();
    for (int i = 9; i >= 0; i--) {
        text[i] = digits[time & 31];
        time >>= 5;
    }
    unsigned char random[16];
    randombytes_buf(random, sizeof random);
    for (int i = 0; i < 16; i++)
        text[10 + i] = digits[random[i] & 31];
    text[26] = '\0';
    snprintf(id, ID_SIZE, "%.4s_%s", kind, text);
}

bool
ulid_is_id(const char *kind, const char *text)
{
    size_t len = strlen(kind);
    if (strncmp(text, kind, len) != 0 || text[len] != '_')
        return false;
    text += len + 1;
    return strlen(text) == 26 && strspn(text, digits) == 26 && text[0] <= '7';
}
