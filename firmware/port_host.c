/* A computer with an operating system: the same application with the same bits, for comparison. */
#include <stdio.h>
#include <stdlib.h>

#include "port.h"

static const char *file;

void print(const char *text) { fputs(text, stdout); }
uint32_t instructions(void) { return 0; }
uint32_t stack_used(void) { return 0; }

const reading *stream(size_t *count) {
  FILE *from = fopen(file, "rb");
  reading *all = malloc(1 << 20);
  *count = from && all ? fread(all, sizeof *all, (1 << 20) / sizeof *all, from) : 0;
  if (from) fclose(from);
  return all;
}

int main(int count, char **arguments) {
  if (count != 2) return 2;
  file = arguments[1];
  return application();
}
