; The vector table, and in the gaps of it, where the vectors of interrupts would be that the
; firmware does not enable: start-up, and the two interrupts that are short enough. That takes the
; place of avr-libc's start-up and saves 134 bytes of flash.
;
; Static objects must be initialised without code: constructors are not called here.
;
; ATmega1284P datasheet, "Interrupt Vectors": number n is at 4 n.
#define __SFR_OFFSET 0
#include <avr/io.h>

#include "client_fw/boards/avr/pins.h"

; objects ask for avr-libc's way to do what is done here
        .global __do_copy_data
        .global __do_clear_bss

        .section .vectors, "ax", @progbits
        .global __vectors
__vectors:
; reset: number 0
        clr r1                          ; zero, as compiled code expects
        out SREG, r1
        ldi r16, lo8(RAMEND)
        ldi r17, hi8(RAMEND)
        out SPL, r16
        out SPH, r17
__do_copy_data:                         ; .data from flash, to __data_end
        ldi r26, lo8(__data_start)
        ldi r27, hi8(__data_start)
        ldi r30, lo8(__data_load_start)
        ldi r31, hi8(__data_load_start)
        ldi r17, hi8(__data_end)
        rjmp 2f
1:      lpm r0, Z+
        st X+, r0
2:      cpi r26, lo8(__data_end)
        cpc r27, r17
        brne 1b
__do_clear_bss:                         ; .bss, which is next to it
        ldi r17, hi8(__bss_end)
        rjmp 4f
3:      st X+, r1
4:      cpi r26, lo8(__bss_end)
        cpc r27, r17
        brne 3b
        jmp main

        .org 4 * TIMER1_COMPA_vect_num  ; a millisecond: one more in GPIOR2:GPIOR1 (loop.h)
        sbi GPIOR0, 0                   ; wakes the main loop
        push r24
        in r24, SREG
        push r24
        in r24, GPIOR1
        subi r24, lo8(-1)
        out GPIOR1, r24
        in r24, GPIOR2
        sbci r24, hi8(-1)
        out GPIOR2, r24
        pop r24
        out SREG, r24
        pop r24
        reti

        .org 4 * USART0_RX_vect_num     ; bytes, in and out
        jmp on_uart_interrupt

        .org 4 * USART0_UDRE_vect_num
        jmp on_uart_interrupt

        .org 4 * USART0_TX_vect_num     ; the radio has sent its last stop bit
        cbi PORTD, PHEROMONE_PTT_BIT
        sbi GPIOR0, 0
        reti

        .org 4 * USART1_RX_vect_num
        jmp on_uart_interrupt

        .org 4 * USART1_UDRE_vect_num
        jmp on_uart_interrupt
