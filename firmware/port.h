/* What the example needs of the machine it runs on. */
#ifndef PORT_H
#define PORT_H

#include <stddef.h>
#include <stdint.h>

/* One sample of the sensors, as the device reads them. */
typedef struct {
  int32_t encoder[3]; /* 2^20 counts a turn */
  int16_t force[2];   /* 2^12 counts over 220 N */
} reading;

/* The recorded stream. */
extern const reading *stream(size_t *count);

/* Text for whoever watches. */
void print(const char *text);

/* Instructions executed so far, to within a step of the counter; differences below 2^24 steps count. Zero where there is
   no counter. */
uint32_t instructions(void);

/* Most bytes of the stack in use since the last call, which begins anew; zero where it cannot be told. */
uint32_t stack_used(void);

int application(void);

#endif
