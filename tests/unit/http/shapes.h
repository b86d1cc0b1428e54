/* shapes.h - requests with two readings, or none, and what must become of
 * them. Used against the gate alone, byte by byte, and against the server. */
#ifndef TESTS_UNIT_HTTP_SHAPES_H
#define TESTS_UNIT_HTTP_SHAPES_H

#include <stddef.h>

struct shape {
    const char *name;
    const char *text;
    size_t len;
    unsigned status; /* of the refusal */
};

#define SHAPE(name, text, status)                                              \
    {                                                                          \
        name, text, sizeof text - 1, status                                    \
    }
#define H       "Host: a\r\n"
#define GET     "GET /hello HTTP/1.1\r\n"
#define POST    "POST /echo HTTP/1.1\r\n" H
#define CHUNKED POST "Transfer-Encoding: chunked\r\n\r\n"

static const struct shape malformed[] = {
    /* two ways to tell where the message ends */
    SHAPE("length and coding",
          POST "Content-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n"
               "0\r\n\r\n",
          400),
    SHAPE("coding and length",
          POST "Transfer-Encoding: chunked\r\nContent-Length: 5\r\n\r\n"
               "0\r\n\r\n",
          400),
    SHAPE("two differing lengths",
          POST "Content-Length: 5\r\nContent-Length: 6\r\n\r\nhello", 400),
    SHAPE("two equal lengths",
          POST "Content-Length: 5\r\ncontent-length: 5\r\n\r\nhello", 400),
    SHAPE("a list of lengths", POST "Content-Length: 5, 5\r\n\r\nhello", 400),
    SHAPE("a signed length", POST "Content-Length: +5\r\n\r\nhello", 400),
    SHAPE("a negative length", POST "Content-Length: -5\r\n\r\nhello", 400),
    SHAPE("a hexadecimal length", POST "Content-Length: 0x5\r\n\r\nhello", 400),
    SHAPE("an empty length", POST "Content-Length:\r\n\r\nhello", 400),
    SHAPE("a length with a gap", POST "Content-Length: 5 0\r\n\r\nhello", 400),
    SHAPE("a length hidden behind white space",
          POST "Content-Length: 5                                 0\r\n\r\n",
          400),
    SHAPE("a length with a space behind",
          POST "Content-Length: 5 \r\n\r\nhello", 400),
    SHAPE("chunked with a space behind",
          POST "Transfer-Encoding: chunked \r\n\r\n0\r\n\r\n", 501),
    SHAPE("a length beyond 64 bits",
          POST "Content-Length: 18446744073709551621\r\n\r\nhello", 400),
    SHAPE("two codings",
          POST "Transfer-Encoding: chunked\r\n"
               "Transfer-Encoding: identity\r\n\r\n0\r\n\r\n",
          400),
    SHAPE("an unknown coding", POST "Transfer-Encoding: xchunked\r\n\r\n", 501),
    SHAPE("gzip, chunked", POST "Transfer-Encoding: gzip, chunked\r\n\r\n",
          501),
    SHAPE("identity", POST "Transfer-Encoding: identity\r\n\r\n", 501),
    SHAPE("chunked with more behind white space",
          POST "Transfer-Encoding: chunked                        x\r\n\r\n",
          501),
    SHAPE("an empty coding", POST "Transfer-Encoding:\r\n\r\n", 501),
    SHAPE("a coding with a vertical tab",
          POST "Transfer-Encoding: \vchunked\r\n\r\n", 400),
    SHAPE("a coding in HTTP/1.0",
          "POST /echo HTTP/1.0\r\nTransfer-Encoding: chunked\r\n\r\n"
          "0\r\n\r\n",
          400),
    /* names that one reader sees and another does not */
    SHAPE("a space before the colon", POST "Content-Length : 5\r\n\r\nhello",
          400),
    SHAPE("a tab before the colon", POST "Content-Length\t: 5\r\n\r\nhello",
          400),
    SHAPE("a folded line", GET H "X: a\r\n b\r\n\r\n", 400),
    SHAPE("a first line that begins with a space", GET " Host: a\r\n\r\n", 400),
    SHAPE("no colon", GET H "Nonsense\r\n\r\n", 400),
    SHAPE("an empty name", GET H ": x\r\n\r\n", 400),
    SHAPE("a NUL in a name", GET H "X\0Y: a\r\n\r\n", 400),
    SHAPE("a NUL that cuts a length", POST "Content-Length\0X: 5\r\n\r\nhello",
          400),
    SHAPE("a NUL in a value", GET H "X: a\0b\r\n\r\n", 400),
    SHAPE("a control byte in a name", GET H "X\001Y: a\r\n\r\n", 400),
    SHAPE("a control byte in a value", GET H "X: a\001b\r\n\r\n", 400),
    SHAPE("DEL in a value", GET H "X: a\177b\r\n\r\n", 400),
    SHAPE("a byte beyond ASCII in a name", GET H "X\377Y: a\r\n\r\n", 400),
    /* lines that one reader ends and another does not */
    SHAPE("a bare LF in the request line", "GET /hello HTTP/1.1\n" H "\r\n",
          400),
    SHAPE("a bare LF in a header", GET "Host: a\nX: b\r\n\r\n", 400),
    SHAPE("a bare LF that ends the head", GET H "\n", 400),
    SHAPE("only bare LF", "GET /hello HTTP/1.1\nHost: a\n\n", 400),
    SHAPE("a bare CR in a header", GET "Host: a\rX: b\r\n\r\n", 400),
    SHAPE("a bare CR in the request line", "GET /hello HTTP/1.1\rX\r\n\r\n",
          400),
    SHAPE("CR CR LF", GET "Host: a\r\r\n\r\n", 400),
    /* whom it is for */
    SHAPE("no Host", GET "\r\n", 400),
    SHAPE("two Hosts", GET H "Host: b\r\n\r\n", 400),
    SHAPE("two Hosts in HTTP/1.0",
          "GET /hello HTTP/1.0\r\nHost: a\r\nHost: b\r\n\r\n", 400),
    /* the request line */
    SHAPE("two spaces", "GET  /hello HTTP/1.1\r\n" H "\r\n", 400),
    SHAPE("a tab for a space", "GET\t/hello HTTP/1.1\r\n" H "\r\n", 400),
    SHAPE("a space in the target", "GET /hel lo HTTP/1.1\r\n" H "\r\n", 400),
    SHAPE("a space behind the version", "GET /hello HTTP/1.1 \r\n" H "\r\n",
          400),
    SHAPE("no version", "GET /hello\r\n" H "\r\n", 400),
    SHAPE("another protocol", "GET /hello HTTQ/1.1\r\n" H "\r\n", 400),
    SHAPE("a lower-case version", "GET /hello http/1.1\r\n" H "\r\n", 400),
    SHAPE("HTTP/1.10", "GET /hello HTTP/1.10\r\n" H "\r\n", 400),
    SHAPE("HTTP/1.2", "GET /hello HTTP/1.2\r\n" H "\r\n", 505),
    SHAPE("HTTP/2.0", "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", 505),
    SHAPE("a NUL in the target", "GET /hello\0 HTTP/1.1\r\n" H "\r\n", 400),
    SHAPE("an encoded NUL", "GET /hello%00x HTTP/1.1\r\n" H "\r\n", 400),
    SHAPE("half an escape", "GET /hello%4 HTTP/1.1\r\n" H "\r\n", 400),
    SHAPE("raw UTF-8 in the target", "GET /h\303\244 HTTP/1.1\r\n" H "\r\n",
          400),
    SHAPE("an absolute target", "GET http://b/hello HTTP/1.1\r\n" H "\r\n",
          400),
    SHAPE("an authority", "CONNECT a:80 HTTP/1.1\r\n" H "\r\n", 400),
    SHAPE("no method", " /hello HTTP/1.1\r\n" H "\r\n", 400),
    SHAPE("a method with a NUL", "G\0T /hello HTTP/1.1\r\n" H "\r\n", 400),
    SHAPE("a method without end",
          "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA / HTTP/1.1\r\n\r\n", 400),
    SHAPE("two empty lines first", "\r\n\r\n" GET H "\r\n", 400),
    SHAPE("an LF first", "\n" GET H "\r\n", 400),
    SHAPE("TLS", "\026\003\001\002\000\001\000\001\374\003\003", 400),
    SHAPE("binary nonsense", "\377\376\000\001\002", 400),
    /* chunks */
    SHAPE("a chunk size with a prefix", CHUNKED "0x5\r\nhello\r\n0\r\n\r\n",
          400),
    SHAPE("a chunk size with a sign", CHUNKED "+5\r\nhello\r\n0\r\n\r\n", 400),
    SHAPE("a chunk size with a space", CHUNKED "5 \r\nhello\r\n0\r\n\r\n", 400),
    SHAPE("an empty chunk size", CHUNKED "\r\nhello\r\n0\r\n\r\n", 400),
    SHAPE("a chunk size beyond 64 bits",
          CHUNKED "10000000000000005\r\nhello\r\n0\r\n\r\n", 400),
    SHAPE("a bare LF behind a chunk size", CHUNKED "5\nhello\r\n0\r\n\r\n",
          400),
    SHAPE("a bare LF behind a chunk", CHUNKED "5\r\nhello\n0\r\n\r\n", 400),
    SHAPE("a chunk longer than it says", CHUNKED "5\r\nhello!\r\n0\r\n\r\n",
          400),
    SHAPE("a bare LF in a chunk extension",
          CHUNKED "5;a\nb\r\nhello\r\n0\r\n\r\n", 400),
    SHAPE("a NUL in a chunk extension", CHUNKED "5;a\0b\r\nhello\r\n0\r\n\r\n",
          400),
    SHAPE("a malformed trailer", CHUNKED "0\r\nX Y: a\r\n\r\n", 400),
    SHAPE("a bare LF that ends the trailers", CHUNKED "0\r\n\n", 400),
};

/* What must be let through, and how many requests it holds. */
static const struct {
    const char *name;
    const char *text;
    size_t len;
    unsigned requests;
} wellformed[] = {
#define GOOD(name, text, requests)                                             \
    {                                                                          \
        name, text, sizeof text - 1, requests                                  \
    }
    GOOD("a plain GET", GET H "\r\n", 1),
    GOOD("an empty Host", GET "Host:\r\n\r\n", 1),
    GOOD("HTTP/1.0 without Host", "GET /hello HTTP/1.0\r\n\r\n", 1),
    GOOD("an empty line first", "\r\n" GET H "\r\n", 1),
    GOOD("a query and escapes",
         "GET /hello?a=%41&b=%c3%a4&c HTTP/1.1\r\n" H "\r\n", 1),
    GOOD("white space around values",
         POST "Content-Length:\t 5\r\nX:  y \t\r\n\r\nhello", 1),
    GOOD("bytes beyond ASCII in a value", GET H "X: \303\244\r\n\r\n", 1),
    GOOD("many token characters", GET H "!#$%&'*+-.^_`|~9: x\r\n\r\n", 1),
    GOOD("a long name that begins like one of ours",
         POST "Transfer-Encoding-Not: gzip\r\nContent-Length-Not: x\r\n"
              "Content-Length: 5\r\n\r\nhello",
         1),
    GOOD("chunks", CHUNKED "5\r\nhello\r\n1;x=\"y\"\r\n!\r\n0\r\n\r\n", 1),
    GOOD("chunks with leading zeros and a trailer",
         CHUNKED "00A\r\n0123456789\r\n0\r\nX: y\r\n\r\n", 1),
    GOOD("CHUNKED in capitals",
         POST "Transfer-Encoding: CHUNKED\r\n\r\n0\r\n\r\n", 1),
    GOOD("a pipeline of three",
         POST "Content-Length: 5\r\n\r\nhello" CHUNKED
              "5\r\nhello\r\n0\r\n\r\n" GET H "\r\n",
         3),
    GOOD("OPTIONS *", "OPTIONS * HTTP/1.1\r\n" H "\r\n", 1),
};

enum {
    MALFORMED_COUNT = sizeof malformed / sizeof malformed[0],
    WELLFORMED_COUNT = sizeof wellformed / sizeof wellformed[0]
};

#endif
