// The soft core with records to work on and eyes on what it does.
//
// The device slot holds the bench: see firmware/attitude/measure.c for its registers. It prints
//   I cycle        the interrupt rises
//   O word         a word of the result
//   D cycle        a record is done
//   C cycles       what the firmware has measured
//   V index word   a figure
//   W cycle        the watchdog restarts the processor
//
// Arguments: records and words of each (records.hex), gap in cycles between them, limit in cycles,
// deaf; those of the console.
module bench #(
    parameter DIVISOR = 8
) (
    input clk,
    input rst
);
    integer records, words, gap, position, waited, limit, deaf;
    reg [31:0] memory [0:65535];
    reg [31:0] now;
    wire [11:0] adr;
    wire [31:0] dat_w;
    reg [31:0] dat_r;
    wire cyc, stb, we, tx, rx, restart;
    reg ack, asks, asked_before, restarted;

    initial begin
        if (!$value$plusargs("records=%d", records)) records = 0;
        if (!$value$plusargs("words=%d", words)) words = 10;
        if (!$value$plusargs("gap=%d", gap)) gap = 0;
        if (!$value$plusargs("limit=%d", limit)) limit = 0;
        if (!$value$plusargs("deaf=%d", deaf)) deaf = 0;
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

    console #(.DIVISOR(DIVISOR)) console (.clk(clk), .rst(rst), .now(now), .tx(tx), .rx(rx));
endmodule
