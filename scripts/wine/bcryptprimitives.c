/* For Wine alone: before version 9 it has no ProcessPrng, which Rust's standard library imports. Windows has had it since version 7. */
#include <windows.h>

BOOLEAN NTAPI SystemFunction036(PVOID place, ULONG size); /* RtlGenRandom, of advapi32 */

__declspec(dllexport) BOOL WINAPI ProcessPrng(PBYTE place, SIZE_T size) { return SystemFunction036(place, (ULONG)size); }
