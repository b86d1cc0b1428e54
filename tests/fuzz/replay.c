/* Runs a fuzz target over files and folders named on the command line, so that
 * every input that once broke it is tried again with any compiler. Each input
 * is copied to a block of exactly its size: a sanitizer sees one byte too far.
 * Inputs that take more than ten seconds fail. */
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/base/bytes.h"
#include "tests/fuzz/fuzz.h"

enum { INPUT_MAX = 64 * 1024 * 1024, SECONDS_MAX = 10 };

static unsigned inputs;

static bool
replay_file(const char *path)
{
    struct bytes text = {0};
    struct error err = {0};
    if (!bytes_read_file(&text, path, INPUT_MAX, &err)) {
        fprintf(stderr, "%s\n", err.text);
        return false;
    }
    uint8_t *copy = malloc(text.len);
    if (copy == NULL && text.len > 0) {
        bytes_clear(&text);
        return false;
    }
    if (text.len > 0)
        memcpy(copy, text.data, text.len);
    printf("%s\n", path);
    fflush(stdout); /* the last line names the input that broke it */
    alarm(SECONDS_MAX);
    LLVMFuzzerTestOneInput(copy, text.len);
    alarm(0);
    free(copy);
    bytes_clear(&text);
    inputs++;
    return true;
}

static bool
replay(const char *path)
{
    struct stat st;
    if (stat(path, &st) != 0) {
        perror(path);
        return false;
    }
    if (!S_ISDIR(st.st_mode))
        return replay_file(path);
    DIR *dir = opendir(path);
    bool ok = dir != NULL;
    for (struct dirent *e; ok && (e = readdir(dir)) != NULL;) {
        char child[4096];
        if (e->d_name[0] == '.')
            continue;
        snprintf(child, sizeof child, "%s/%s", path, e->d_name);
        ok = replay(child);
    }
    if (dir != NULL)
        closedir(dir);
    return ok;
}

int
main(int argc, char **argv)
{
    for (int i = 1; i < argc; i++) {
        if (!replay(argv[i]))
            return 1;
    }
    printf("%u inputs\n", inputs);
    return inputs > 0 ? 0 : 1;
}
