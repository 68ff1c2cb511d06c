; Any of four interrupts (vectors.S): a byte came in, or one more can go out, on either UART. A
; routine for all is half the size of four, and looking twice does no harm. In assembly because the
; compiler saves registers that it does not use: 40 bytes.
#define __SFR_OFFSET 0
#include <avr/io.h>

#include "client_fw/boards/avr/uarts.h"

; Y: the Uart (uarts.h). Z: its registers, the second UART's 8 behind the first's; so r31 is 0.
#define STATUS 0  /* UCSRnA */
#define CONTROL 1 /* UCSRnB */
#define DATA 6    /* UDRn */
#define NEXT_UART 8

        .section .text.on_uart_interrupt, "ax", @progbits
        .global on_uart_interrupt
on_uart_interrupt:
        sbi GPIOR0, 0                   ; wakes the main loop
        push r24
        in r24, SREG
        push r24
        push r25
        push r26
        push r27
        push r28
        push r29
        push r30
        push r31
        ldi r28, lo8(uarts)
        ldi r29, hi8(uarts)
        ldi r30, lo8(UCSR0A)
        clr r31

receive:
        ldd r24, Z+STATUS
        sbrs r24, RXC0
        rjmp send
        ldd r25, Y+UART_FRAMING_ERRORS  ; both flags are of the byte to be taken next
        sbrc r24, FE0
        inc r25
        std Y+UART_FRAMING_ERRORS, r25
        ldd r25, Y+UART_OVERRUNS
        sbrc r24, DOR0
        inc r25
        std Y+UART_OVERRUNS, r25
        ldd r24, Y+UART_RECEIVED_IN
        movw r26, r28
        add r26, r24
        adc r27, r31
        adiw r26, UART_RECEIVED
        ldd r25, Z+DATA                 ; has to be taken even if there is no room
        st X, r25
        inc r24
        andi r24, UART_RING_SIZE - 1
        ldd r25, Y+UART_RECEIVED_OUT
        cpse r24, r25                   ; full: the byte is overwritten by the next
        std Y+UART_RECEIVED_IN, r24

send:
        ldd r24, Z+STATUS
        sbrs r24, UDRE0
        rjmp next
        ldd r24, Y+UART_TO_SEND_OUT
        ldd r25, Y+UART_TO_SEND_IN
        cpse r24, r25
        rjmp send_byte
        ldd r25, Z+CONTROL              ; nothing to send: no more interrupts until there is
        andi r25, ~(1 << UDRIE0)
        std Z+CONTROL, r25
        rjmp next
send_byte:
        movw r26, r28
        add r26, r24
        adc r27, r31
        subi r26, lo8(-UART_TO_SEND)
        sbci r27, hi8(-UART_TO_SEND)
        ld r25, X
        std Z+DATA, r25
        ; Transmission is complete only once this byte is out: TXC, should it be up, is cleared.
        ldd r25, Z+STATUS
        andi r25, 1 << U2X0
        ori r25, 1 << TXC0
        std Z+STATUS, r25
        inc r24
        andi r24, UART_RING_SIZE - 1
        std Y+UART_TO_SEND_OUT, r24

next:
        subi r28, lo8(-UART_SIZE)
        sbci r29, hi8(-UART_SIZE)
        adiw r30, NEXT_UART
        cpi r30, lo8(UCSR0A + 2 * NEXT_UART)
        brne receive
        pop r31
        pop r30
        pop r29
        pop r28
        pop r27
        pop r26
        pop r25
        pop r24
        out SREG, r24
        pop r24
        reti
