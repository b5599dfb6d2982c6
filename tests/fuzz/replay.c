/// Calls a target with inputs that are kept in a file, each behind its length (two bytes, low one first):
/// without libFuzzer. tools/proofs/fuzz.py writes such files.
#include <stdio.h>

#include "fuzz.h"

static bool read_size(FILE *file, size_t *size)
{
    const int low = fgetc(file);
    const int high = fgetc(file);
    *size = (size_t)(low + 256 * high);
    return low != EOF && high != EOF;
}

int main(int argc, char **argv)
{
    static uint8_t bytes[UINT16_MAX];
    FILE *file = argc == 2 ? fopen(argv[1], "rb") : NULL;
    if (file == NULL) {
        (void)fprintf(stderr, "usage: %s FILE\n", argv[0]);
        return 2;
    }
    int count = 0;
    for (size_t size; read_size(file, &size); count++) {
        fuzz_require(fread(bytes, 1, size, file) == size);
        (void)LLVMFuzzerTestOneInput(bytes, size);
    }
    (void)fclose(file);
    (void)printf("%d inputs\n", count);
    return count > 0 ? 0 : 1;
}
