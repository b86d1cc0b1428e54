#include "server/http/gate.h"

#include <string.h>

enum state {
    START,    /* before a method; one empty line is forgiven */
    BLANK_LF, /* ... its LF */
    METHOD,
    TARGET,
    PERCENT_1, /* %XY in the target: X */
    PERCENT_2, /* ... Y */
    VERSION,   /* gate->line counts the characters of HTTP/#.# */
    LINE_LF,   /* the LF that ends the request line */
    NAME_START,
    NAME,
    VALUE,
    VALUE_LF,
    HEAD_LF, /* the LF of the empty line */
    BODY,
    SIZE,      /* of a chunk; gate->line counts the line's bytes */
    EXTENSION, /* ... from the semicolon on */
    SIZE_LF,
    CHUNK,
    CHUNK_CR,
    CHUNK_LF,
    SHUT
};

enum { METHOD_MAX = 32, SIZE_LINE_MAX = 256, SIZE_DIGITS_MAX = 15 };

static const char bare_lf[] =
    "a line ends with a bare LF; lines end with CR LF";
static const char bare_cr[] = "a CR is not followed by LF";
static const char request_line[] =
    "the request line must be METHOD, one space, a target that begins with "
    "'/', one space, HTTP/1.1";

static bool
refuse(struct gate *gate, enum gate_refusal refusal, const char *detail)
{
    gate->state = SHUT;
    gate->refusal = (uint8_t)refusal;
    gate->detail = detail;
    return false;
}

static bool
bad(struct gate *gate, const char *detail)
{
    return refuse(gate, GATE_MALFORMED, detail);
}

static bool
is_token(unsigned char c)
{
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') ||
           (c >= 'A' && c <= 'Z') ||
           (c != 0 && strchr("!#$%&'*+-.^_`|~", c) != NULL);
}

static int
hex(unsigned char c)
{
    if (c >= '0' && c <= '9')
        return c - '0';
    c |= 0x20;
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

static char
lower(unsigned char c)
{
    return (char)(c >= 'A' && c <= 'Z' ? c + 32 : c);
}

/* A byte that no field value may have: controls but HTAB, and DEL. */
static bool
is_control(unsigned char c)
{
    return (c < 0x20 && c != '\t') || c == 0x7f;
}

static bool
line_error(struct gate *gate, unsigned char c, const char *otherwise)
{
    return bad(gate, c == '\n' ? bare_lf : otherwise);
}

/* --- the request line --- */

static bool
see_start(struct gate *gate, unsigned char c)
{
    if (c == '\r' && !gate->blank) {
        gate->state = BLANK_LF;
        return true;
    }
    if (!is_token(c))
        return line_error(gate, c, request_line);
    *gate = (struct gate){.heads = gate->heads, .state = METHOD, .line = 1};
    return true;
}

static bool
see_method(struct gate *gate, unsigned char c)
{
    if (c == ' ') {
        gate->state = TARGET;
        gate->line = 0;
        return true;
    }
    if (!is_token(c) || ++gate->line > METHOD_MAX)
        return line_error(gate, c, request_line);
    return true;
}

static bool
see_target(struct gate *gate, unsigned char c)
{
    bool first = gate->line == 0;
    gate->line = 1;
    if (first)
        return c == '/' || c == '*' || line_error(gate, c, request_line);
    if (c == ' ') {
        gate->state = VERSION;
        gate->line = 0;
        return true;
    }
    if (c == '%') {
        gate->state = PERCENT_1;
        return true;
    }
    if (c <= 0x20 || c >= 0x7f)
        return line_error(gate, c,
                          "the target has a byte that must be "
                          "percent-encoded there");
    return true;
}

static bool
see_percent(struct gate *gate, unsigned char c)
{
    static const char detail[] = "a percent sign in the target needs two "
                                 "hexadecimal digits, and not 00";
    int digit = hex(c);
    if (digit < 0)
        return line_error(gate, c, detail);
    if (gate->state == PERCENT_1) {
        gate->value_len = (uint8_t)digit;
        gate->state = PERCENT_2;
        return true;
    }
    if (gate->value_len == 0 && digit == 0)
        return bad(gate, detail);
    gate->state = TARGET;
    return true;
}

static bool
see_version(struct gate *gate, unsigned char c)
{
    static const char pattern[] = "HTTP/#.#";
    if (gate->line == sizeof pattern - 1) {
        if (c != '\r')
            return line_error(gate, c, request_line);
        gate->state = LINE_LF;
        if (gate->name[0] != '1' ||
            (gate->name[1] != '0' && gate->name[1] != '1'))
            return refuse(gate, GATE_VERSION, "HTTP/1.0 and HTTP/1.1 only");
        gate->http10 = gate->name[1] == '0';
        return true;
    }
    char expected = pattern[gate->line++];
    if (expected == '#') {
        gate->name[gate->line == sizeof pattern - 1] = (char)c;
        return (c >= '0' && c <= '9') || line_error(gate, c, request_line);
    }
    return c == (unsigned char)expected || line_error(gate, c, request_line);
}

/* --- headers and trailers --- */

static bool
name_is(const struct gate *gate, const char *name)
{
    size_t len = strlen(name);
    return gate->name_len == len && memcmp(gate->name, name, len) == 0;
}

static void
count(uint8_t *counter)
{
    if (*counter < 2)
        ++*counter;
}

static bool
read_length(struct gate *gate)
{
    static const char detail[] = "Content-Length must be one decimal number";
    count(&gate->lengths);
    if (gate->value_len == 0 || gate->value_len > 18 || gate->cut)
        return bad(gate, detail);
    gate->length = 0;
    for (unsigned i = 0; i < gate->value_len; i++) {
        unsigned char c = (unsigned char)gate->value[i];
        if (c < '0' || c > '9')
            return bad(gate, detail);
        gate->length = gate->length * 10 + (uint64_t)(c - '0');
    }
    return true;
}

static bool
read_coding(struct gate *gate)
{
    count(&gate->codings);
    for (unsigned i = 0; i < gate->value_len; i++)
        gate->value[i] = lower((unsigned char)gate->value[i]);
    gate->chunked = gate->value_len == 7 && !gate->cut &&
                    memcmp(gate->value, "chunked", 7) == 0;
    return true;
}

/* A header line is over: does it frame the message? White space behind the
 * value, which the standard allows, is refused here: the library keeps it and
 * then takes `chunked ` for a body that ends with the connection. */
static bool
end_header(struct gate *gate)
{
    if (gate->trailer)
        return true;
    if (name_is(gate, "host"))
        count(&gate->hosts);
    else if (name_is(gate, "content-length"))
        return read_length(gate);
    else if (name_is(gate, "transfer-encoding"))
        return read_coding(gate);
    return true;
}

/* The head is whole: is there one way to tell where the message ends? */
static bool
end_head(struct gate *gate)
{
    if (gate->hosts > 1)
        return bad(gate, "there is more than one Host");
    if (gate->hosts == 0 && !gate->http10)
        return bad(gate, "an HTTP/1.1 request needs a Host");
    if (gate->lengths > 1)
        return bad(gate, "there is more than one Content-Length");
    if (gate->codings > 0 && gate->lengths > 0)
        return bad(gate, "there is a Content-Length and a Transfer-Encoding");
    if (gate->codings > 1)
        return bad(gate, "there is more than one Transfer-Encoding");
    if (gate->codings > 0 && gate->http10)
        return bad(gate, "an HTTP/1.0 request has no Transfer-Encoding");
    if (gate->codings > 0 && !gate->chunked)
        return refuse(gate, GATE_CODING,
                      "the only transfer coding understood is chunked");
    gate->heads++;
    gate->line = 0;
    gate->left = gate->chunked ? 0 : gate->length;
    gate->state = gate->chunked ? SIZE : gate->left > 0 ? BODY : START;
    return true;
}

static bool
see_name_start(struct gate *gate, unsigned char c)
{
    gate->name_len = 0;
    gate->value_len = 0;
    gate->cut = false;
    if (c == '\r') {
        gate->state = HEAD_LF;
        return true;
    }
    if (c == ' ' || c == '\t')
        return bad(gate, "a header line begins with white space");
    if (c == ':' || !is_token(c))
        return line_error(gate, c,
                          "a header name has a byte that is not "
                          "allowed there");
    gate->name[gate->name_len++] = lower(c);
    gate->state = NAME;
    return true;
}

static bool
see_name(struct gate *gate, unsigned char c)
{
    if (c == ':') {
        gate->state = VALUE;
        return true;
    }
    if (c == '\r')
        return bad(gate, "a header line has no colon");
    if (!is_token(c))
        return line_error(gate, c,
                          "a header name has a byte that is not "
                          "allowed there");
    if (gate->name_len < sizeof gate->name)
        gate->name[gate->name_len++] = lower(c);
    return true;
}

static bool
see_value(struct gate *gate, unsigned char c)
{
    if (c == '\r') {
        gate->state = VALUE_LF;
        return true;
    }
    if (is_control(c))
        return line_error(gate, c, "a header has a control byte");
    if (gate->value_len == 0 && (c == ' ' || c == '\t'))
        return true;
    if (gate->value_len < sizeof gate->value)
        gate->value[gate->value_len++] = (char)c;
    else if (c != ' ' && c != '\t')
        gate->cut = true;
    return true;
}

/* --- chunks --- */

static bool
see_size(struct gate *gate, unsigned char c)
{
    int digit = hex(c);
    if (digit >= 0 && gate->line < SIZE_DIGITS_MAX) {
        gate->left = gate->left * 16 + (uint64_t)digit;
        gate->line++;
        return true;
    }
    if (gate->line > 0 && (c == '\r' || c == ';')) {
        gate->state = c == '\r' ? SIZE_LF : EXTENSION;
        return true;
    }
    return line_error(gate, c,
                      "the size of a chunk must be a hexadecimal "
                      "number of 1 to 15 digits");
}

static bool
see_extension(struct gate *gate, unsigned char c)
{
    if (c == '\r') {
        gate->state = SIZE_LF;
        return true;
    }
    if (is_control(c) || ++gate->line > SIZE_LINE_MAX)
        return line_error(gate, c,
                          "a chunk extension has a control byte or "
                          "more than 256 bytes");
    return true;
}

static bool
end_size(struct gate *gate)
{
    gate->line = 0;
    gate->trailer = gate->left == 0;
    gate->state = gate->trailer ? NAME_START : CHUNK;
    return true;
}

/* After an LF that had its CR. */
static bool
see_lf(struct gate *gate, unsigned char c)
{
    if (c != '\n')
        return bad(gate, bare_cr);
    switch (gate->state) {
    case BLANK_LF:
        gate->blank = true;
        gate->state = START;
        return true;
    case VALUE_LF: gate->state = NAME_START; return end_header(gate);
    case HEAD_LF: gate->state = START; return gate->trailer || end_head(gate);
    case SIZE_LF: return end_size(gate);
    case CHUNK_LF: gate->state = SIZE; return true;
    default: /* LINE_LF */ gate->state = NAME_START; return true;
    }
}

static bool
see_chunk_end(struct gate *gate, unsigned char c)
{
    gate->state = CHUNK_LF;
    return c == '\r' || line_error(gate, c, "a chunk is longer than its size");
}

static bool
see_nothing(struct gate *gate, unsigned char c)
{
    (void)gate, (void)c;
    return false;
}

/* Who looks at a byte; bytes of bodies are counted in gate_feed. */
static bool (*const see[])(struct gate *gate, unsigned char c) = {
    [START] = see_start,
    [BLANK_LF] = see_lf,
    [METHOD] = see_method,
    [TARGET] = see_target,
    [PERCENT_1] = see_percent,
    [PERCENT_2] = see_percent,
    [VERSION] = see_version,
    [LINE_LF] = see_lf,
    [NAME_START] = see_name_start,
    [NAME] = see_name,
    [VALUE] = see_value,
    [VALUE_LF] = see_lf,
    [HEAD_LF] = see_lf,
    [SIZE] = see_size,
    [EXTENSION] = see_extension,
    [SIZE_LF] = see_lf,
    [CHUNK_CR] = see_chunk_end,
    [CHUNK_LF] = see_lf,
    [SHUT] = see_nothing,
};

bool
gate_feed(struct gate *gate, const char *data, size_t n, size_t *whole)
{
    *whole = 0;
    for (size_t i = 0; i < n;) {
        /* Bytes of a body are only counted. */
        if (gate->state == BODY || gate->state == CHUNK) {
            size_t take = n - i;
            if (take > gate->left)
                take = (size_t)gate->left;
            gate->left -= take;
            i += take;
            if (gate->left == 0)
                gate->state = gate->state == BODY ? START : CHUNK_CR;
        } else if (!see[gate->state](gate, (unsigned char)data[i++]))
            return false;
        if (gate->state == START && !gate->blank)
            *whole = i;
    }
    return true;
}

bool
gate_between(const struct gate *gate)
{
    return gate->state == START;
}
