// The soft core, with recorded inputs in its device slot: see firmware/attitude/measure.c.
// Arguments: records, and words of each (records.hex). It prints every word that the program gives.
module bench (
    input clk,
    input rst
);
    integer records, words, shown;
    reg [31:0] memory [0:1048575];
    wire [11:0] adr;
    wire [31:0] dat_w, word;
    reg [31:0] dat_r;
    wire cyc, stb, we, word_valid;
    reg ack;
    wire asked = cyc && stb && !ack;

    initial begin
        if (!$value$plusargs("records=%d", records)) records = 0;
        if (!$value$plusargs("words=%d", words)) words = 0;
        $readmemh("records.hex", memory, 0, records * words - 1);
    end

    soc soc (
        .clk(clk), .rst(rst), .word(word), .word_valid(word_valid),
        .slot__adr(adr), .slot__dat_w(dat_w), .slot__dat_r(dat_r), .slot__cyc(cyc),
        .slot__stb(stb), .slot__we(we), .slot__ack(ack), .slot__sel(), .slot__cti()
    );

    always @(posedge clk) begin
        ack <= asked && !rst;
        if (word_valid) $display("W %h", word);
        if (asked && we && adr == 0) $finish;
        if (asked && we && adr == 1) shown <= dat_w;
        if (asked && !we) dat_r <= adr >= 16 ? memory[shown * words + adr - 16] : records;
    end
endmodule
