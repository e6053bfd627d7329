// The soft core with records to work on and eyes on what it does.
//
// The device slot holds the bench: see firmware/soc/measure.c for its registers. It prints
//   I cycle        the interrupt rises
//   O word         a word of the result
//   D cycle        a record is done
//   C cycles       what the firmware has measured
//   V index word   a figure
//   T byte         a byte from the console
//   W cycle        the watchdog restarts the processor
//
// Arguments: records and words of each (records.hex), gap in cycles between them, limit in cycles,
// deaf, keys (bytes in hexadecimal) and keys_at.
module bench #(
    parameter DIVISOR = 8
) (
    input clk,
    input rst
);
    integer records, words, gap, position, waited, limit, deaf, keys_at;
    reg [63:0] keys;
    reg [31:0] memory [0:65535];
    reg [31:0] now;
    wire [11:0] adr;
    wire [31:0] dat_w;
    reg [31:0] dat_r;
    wire cyc, stb, we, tx, restart;
    reg rx;
    reg ack, asks, asked_before, restarted;

    initial begin
        if (!$value$plusargs("records=%d", records)) records = 0;
        if (!$value$plusargs("words=%d", words)) words = 10;
        if (!$value$plusargs("gap=%d", gap)) gap = 0;
        if (!$value$plusargs("limit=%d", limit)) limit = 0;
        if (!$value$plusargs("deaf=%d", deaf)) deaf = 0;
        if (!$value$plusargs("keys=%h", keys)) keys = 0;
        if (!$value$plusargs("keys_at=%d", keys_at)) keys_at = 0;
        if (records > 0) $readmemh("records.hex", memory, 0, records * words - 1);
        position = 0;
        waited = 0;
        asks = 0;
        asked_before = 0;
        now = 0;
        restarted = 0;
    end

    soc soc (
        .clk(clk), .rst(rst), .rx(rx), .tx(tx), .restart(restart), .interrupt(asks && !asked_before),
        .slot__adr(adr), .slot__dat_w(dat_w), .slot__dat_r(dat_r), .slot__cyc(cyc),
        .slot__stb(stb), .slot__we(we), .slot__ack(ack)
    );

    // A deaf bench does not answer below this address.
    wire asked = cyc && stb && !ack && adr >= deaf;

    always @(posedge clk) begin
        now <= now + 1;
        ack <= asked && !rst;
        restarted <= restart;
        asked_before <= asks;
        if (restart && !restarted) $display("W %0d", now);
        if (limit != 0 && now >= limit) $finish;
        if (asked && !we) dat_r <= adr >= 16 ? memory[position * words + (adr - 16)]
                                             : records - position;
        if (!asks && position < records && !rst) begin
            if (waited >= gap) begin
                asks <= 1;
                waited <= 0;
                $display("I %0d", now);
            end else waited <= waited + 1;
        end
        if (asked && we) begin
            if (adr == 0) begin
                $display("D %0d", now);
                position <= position + 1;
                asks <= 0;
            end else if (adr == 1) $display("C %0d", dat_w);
            else if (adr == 2) $finish;
            else if (adr < 16) $display("V %0d %0d", adr, dat_w);
            else $display("O %h", dat_w);
        end
    end

    // Keys: bytes to the console, the lowest first, from the cycle keys_at on.
    integer key_ticks, key_bit;
    initial begin
        rx = 1;
        key_ticks = 0;
        key_bit = 0;
    end
    always @(posedge clk) if (now >= keys_at && keys != 0) begin
        if (key_ticks == 0) begin
            key_ticks <= DIVISOR - 1;
            rx <= key_bit == 0 ? 1'b0 : key_bit <= 8 ? keys[key_bit - 1] : 1'b1;
            key_bit <= key_bit == 11 ? 0 : key_bit + 1;
            if (key_bit == 11) keys <= keys >> 8;
        end else key_ticks <= key_ticks - 1;
    end

    // Console: bits in the middle of their time.
    integer ticks;
    reg [9:0] bits;
    reg busy;
    reg [3:0] count;
    initial begin
        ticks = 0;
        busy = 0;
        count = 0;
    end
    always @(posedge clk) begin
        if (!busy) begin
            if (!tx && !rst) begin
                busy <= 1;
                ticks <= DIVISOR / 2;
                count <= 0;
            end
        end else if (ticks == 0) begin
            bits <= {tx, bits[9:1]};
            ticks <= DIVISOR - 1;
            count <= count + 1;
            if (count == 9) begin
                busy <= 0;
                $display("T %0d", bits[9:2]);
            end
        end else ticks <= ticks - 1;
    end
endmodule
