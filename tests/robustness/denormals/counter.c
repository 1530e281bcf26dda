/* Counts the floating-point instructions of a process that have a subnormal operand or result, as a library for
   LD_PRELOAD on x86-64 Linux:

     cc -O1 -shared -fPIC counter.c -o counter.so
     DENORMALS=counts LD_PRELOAD=./counter.so PROGRAM ...

   The file named by DENORMALS gets the total, then "count address" for each instruction, by address in the program, which
   `addr2line -e PROGRAM -f -C -i ADDRESS` resolves.

   The denormal and underflow exceptions are unmasked, in all threads, because a thread inherits the control word of the
   one that starts it. Each exception is counted, then masked while the processor executes the one instruction again. */
#define _GNU_SOURCE
#include <link.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <ucontext.h>
#include <unistd.h>
#include <xmmintrin.h>

enum {
    STATUS_FLAGS = 0x3f,
    DENORMAL_AND_UNDERFLOW_MASKS = 0x900,
    SINGLE_STEP = 0x100,
    TABLE_SIZE = 1 << 14,
};

static unsigned long program_base;
static unsigned long total;
/* Open addressing by instruction. */
static unsigned long addresses[TABLE_SIZE];
static unsigned long counts[TABLE_SIZE];

static void count_instruction(unsigned long address) {
    unsigned slot = address * 0x9e3779b97f4a7c15ul >> 50;
    for (int probes = 0; probes < TABLE_SIZE; probes++, slot = (slot + 1) % TABLE_SIZE) {
        unsigned long empty = 0;
        if (__atomic_compare_exchange_n(&addresses[slot], &empty, address, 0, __ATOMIC_RELAXED, __ATOMIC_RELAXED)
            || empty == address) {
            __atomic_fetch_add(&counts[slot], 1, __ATOMIC_RELAXED);
            break;
        }
    }
    __atomic_fetch_add(&total, 1, __ATOMIC_RELAXED);
}

static void on_exception(int number, siginfo_t *info, void *context) {
    mcontext_t *machine = &((ucontext_t *)context)->uc_mcontext;
    (void)number, (void)info;
    count_instruction(machine->gregs[REG_RIP]);
    machine->fpregs->mxcsr = (machine->fpregs->mxcsr | DENORMAL_AND_UNDERFLOW_MASKS) & ~STATUS_FLAGS;
    machine->gregs[REG_EFL] |= SINGLE_STEP;
}

static void on_single_step(int number, siginfo_t *info, void *context) {
    mcontext_t *machine = &((ucontext_t *)context)->uc_mcontext;
    (void)number, (void)info;
    machine->fpregs->mxcsr &= ~(DENORMAL_AND_UNDERFLOW_MASKS | STATUS_FLAGS);
    machine->gregs[REG_EFL] &= ~SINGLE_STEP;
}

static int set_program_base(struct dl_phdr_info *object, size_t size, void *data) {
    (void)size, (void)data;
    program_base = object->dlpi_addr;
    return 1; /* The program comes first. */
}

static void handle(int number, void (*handler)(int, siginfo_t *, void *)) {
    struct sigaction action = {.sa_sigaction = handler, .sa_flags = SA_SIGINFO | SA_NODEFER};
    sigaction(number, &action, NULL);
}

__attribute__((constructor)) static void start(void) {
    if (!getenv("DENORMALS")) return;
    dl_iterate_phdr(set_program_base, NULL);
    handle(SIGFPE, on_exception);
    handle(SIGTRAP, on_single_step);
    _mm_setcsr(_mm_getcsr() & ~(DENORMAL_AND_UNDERFLOW_MASKS | STATUS_FLAGS));
}

__attribute__((destructor)) static void report(void) {
    const char *path = getenv("DENORMALS");
    if (!path) return;
    _mm_setcsr(_mm_getcsr() | DENORMAL_AND_UNDERFLOW_MASKS);
    FILE *file = fopen(path, "w");
    if (!file) return;
    fprintf(file, "%lu\n", total);
    for (int i = 0; i < TABLE_SIZE; i++)
        if (counts[i]) fprintf(file, "%lu 0x%lx\n", counts[i], addresses[i] - program_base);
    fclose(file);
}
