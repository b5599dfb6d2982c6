// A plugin for QEMU's translator: how often each block of the guest's instructions ran. Writes a line a block
// at the end: address, instructions executed in it. tools/bench/profile_image.py builds and reads it.
//
// Debian has no header for plugins; what is used of QEMU's API version 1 is declared here.
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

typedef uint64_t qemu_plugin_id_t;
typedef struct qemu_info qemu_info_t;
struct qemu_plugin_tb;
enum { QEMU_PLUGIN_INLINE_ADD_U64 = 0 };

typedef void (*translated_fn)(qemu_plugin_id_t id, struct qemu_plugin_tb *block);
typedef void (*end_fn)(qemu_plugin_id_t id, void *data);
void qemu_plugin_register_vcpu_tb_trans_cb(qemu_plugin_id_t id, translated_fn callback);
void qemu_plugin_register_atexit_cb(qemu_plugin_id_t id, end_fn callback, void *data);
void qemu_plugin_register_vcpu_tb_exec_inline(struct qemu_plugin_tb *block, int operation, void *counter,
                                              uint64_t value);
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *block);
uint64_t qemu_plugin_tb_vaddr(const struct qemu_plugin_tb *block);

__attribute__((visibility("default"))) int qemu_plugin_version = 1;
__attribute__((visibility("default"))) int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t *info,
                                                               int argc, char **argv);

typedef struct block {
    struct block *next;
    uint64_t address;
    uint64_t instructions;
} block_t;

static block_t *blocks;
static const char *path;

static void count_block(qemu_plugin_id_t id, struct qemu_plugin_tb *translated)
{
    block_t *block = calloc(1, sizeof *block);
    (void)id;
    if (block == NULL) {
        abort();
    }
    block->next = blocks;
    block->address = qemu_plugin_tb_vaddr(translated);
    blocks = block;
    qemu_plugin_register_vcpu_tb_exec_inline(translated, QEMU_PLUGIN_INLINE_ADD_U64, &block->instructions,
                                             qemu_plugin_tb_n_insns(translated));
}

static void write_blocks(qemu_plugin_id_t id, void *data)
{
    FILE *file = fopen(path, "w");
    (void)id;
    (void)data;
    if (file == NULL) {
        abort();
    }
    for (const block_t *block = blocks; block != NULL; block = block->next) {
        fprintf(file, "%llx %llu\n", (unsigned long long)block->address,
                (unsigned long long)block->instructions);
    }
    fclose(file);
}

// The argument is where to write, "to=PATH".
int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t *info, int argc, char **argv)
{
    (void)info;
    if (argc != 1) {
        return 1;
    }
    path = argv[0] + sizeof "to=" - 1;
    qemu_plugin_register_vcpu_tb_trans_cb(id, count_block);
    qemu_plugin_register_atexit_cb(id, write_blocks, NULL);
    return 0;
}
