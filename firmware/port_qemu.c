/* Cortex-M under QEMU: start-up, semihosting, and the SysTick timer as a counter of instructions. */
#include "port.h"

extern uint32_t data_begin[], data_end[], data_load[], bss_begin[], bss_end[], stack_begin[], stack_end[];
extern const reading stream_begin[], stream_end[];

#define CPACR (*(volatile uint32_t *)0xE000ED88)
#define SYST_CSR (*(volatile uint32_t *)0xE000E010)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018)

/* With -icount shift=0 an instruction takes 1 ns, and the timer runs at 25 MHz. */
#define INSTRUCTIONS_PER_TICK 40u
#define PAINT 0xA5A5A5A5u

static int semihosting(int operation, const void *argument) {
  register int r0 __asm__("r0") = operation;
  register const void *r1 __asm__("r1") = argument;
  __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

void print(const char *text) { semihosting(0x04, text); }

static void stop(int status) {
  const uint32_t block[2] = {0x20026u, (uint32_t)status};
  semihosting(0x20, block);
  for (;;) {
  }
}

uint32_t instructions(void) { return (0xFFFFFFu - SYST_CVR) * INSTRUCTIONS_PER_TICK; }

/* Paints the stack below this function's own frame. */
static void paint(void) {
  uint32_t *here;
  __asm__ volatile("mov %0, sp" : "=r"(here));
  for (uint32_t *word = stack_begin; word < here - 8; word++) *word = PAINT;
}

uint32_t stack_used(void) {
  const uint32_t *word = stack_begin;
  while (word < stack_end && *word == PAINT) word++;
  uint32_t used = (uint32_t)((const char *)stack_end - (const char *)word);
  paint();
  return used;
}

const reading *stream(size_t *count) {
  *count = (size_t)(stream_end - stream_begin);
  return stream_begin;
}

void reset(void) {
  CPACR |= 0xF00000u; /* the FPU, before anything uses it */
  __asm__ volatile("dsb\n isb");
  for (uint32_t *to = data_begin, *from = data_load; to < data_end;) *to++ = *from++;
  for (uint32_t *to = bss_begin; to < bss_end;) *to++ = 0;
  paint();
  SYST_RVR = 0xFFFFFFu;
  SYST_CVR = 0;
  SYST_CSR = 5;
  stop(application());
}

static void fault(void) {
  print("fault\n");
  stop(1);
}

typedef union {
  const void *stack;
  void (*run)(void);
} vector;

__attribute__((section(".vectors"), used)) static const vector vectors[] = {
    {.stack = stack_end}, {.run = reset}, {.run = fault}, {.run = fault}, {.run = fault}, {.run = fault}, {.run = fault},
};
