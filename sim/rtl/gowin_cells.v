// Cells of Gowin's GW2A that yosys' library has no behaviour for: block RAM with bytes of nine bits as
// Gowin UG285 (BSRAM and SSRAM user guide) describes it, multipliers as UG287 (DSP user guide) does.
//
// CONTENTS is INIT_RAM_00... side by side; the netlist's writer does that. What is not there is fatal
// to use: resets, blocks that are not selected, operands from the block beside.

module DPX9B #(
    parameter [64*288-1:0] CONTENTS = 0,
    parameter BIT_WIDTH_0 = 18, BIT_WIDTH_1 = 18, READ_MODE0 = 0, READ_MODE1 = 0,
    parameter WRITE_MODE0 = 0, WRITE_MODE1 = 0, BLK_SEL_0 = 0, BLK_SEL_1 = 0, RESET_MODE = "SYNC"
) (
    input CLKA, CLKB, CEA, CEB, OCEA, OCEB, WREA, WREB, RESETA, RESETB,
    input [2:0] BLKSELA, BLKSELB,
    input [13:0] ADA, ADB,
    input [35:0] DIA, DIB,
    output [35:0] DOA, DOB
);
    function [8*11-1:0] mode(input integer number);
        mode = number == 0 ? "NO_CHANGE" : number == 1 ? "WRITE_FIRST" : "READ_FIRST";
    endfunction
    // A port of 18 bits or more has its byte enables at the low bits of its address.
    function [3:0] lanes(input integer width, input [3:0] low);
        lanes = width == 36 ? low : width == 18 ? {2'd0, low[1:0]} : 4'd1;
    endfunction
    always @(posedge CLKA or posedge CLKB)
        if (RESETA || RESETB || BLKSELA != BLK_SEL_0 || BLKSELB != BLK_SEL_1)
            $fatal(1, "a reset or a selection of a block RAM is not simulated");

    wire [35:0] now_a, now_b;
    nine_bit_ram #(
        .ROW(18), .CONTENTS(CONTENTS), .WIDTH_A(BIT_WIDTH_0), .WIDTH_B(BIT_WIDTH_1),
        .MODE_A(mode(WRITE_MODE0)), .MODE_B(mode(WRITE_MODE1))
    ) ram (
        .clk_a(CLKA), .clk_b(CLKB), .en_a(CEA), .en_b(CEB), .rst_a(1'b0), .rst_b(1'b0),
        .writes_a(WREA), .writes_b(WREB), .addr_a(ADA), .addr_b(ADB),
        .we_a(WREA ? lanes(BIT_WIDTH_0, ADA[3:0]) : 4'd0),
        .we_b(WREB ? lanes(BIT_WIDTH_1, ADB[3:0]) : 4'd0),
        .di_a(DIA), .di_b(DIB), .do_a(now_a), .do_b(now_b)
    );
    reg [35:0] later_a = 0, later_b = 0;
    always @(posedge CLKA) if (OCEA) later_a <= now_a;
    always @(posedge CLKB) if (OCEB) later_b <= now_b;
    assign DOA = READ_MODE0 ? later_a : now_a, DOB = READ_MODE1 ? later_b : now_b;
endmodule

// Written by port A, read by port B.
module SDPX9B #(
    parameter [64*288-1:0] CONTENTS = 0,
    parameter BIT_WIDTH_0 = 36, BIT_WIDTH_1 = 36, READ_MODE = 0,
    parameter BLK_SEL_0 = 0, BLK_SEL_1 = 0, RESET_MODE = "SYNC"
) (
    input CLKA, CLKB, CEA, CEB, OCE, RESETA, RESETB,
    input [2:0] BLKSELA, BLKSELB,
    input [13:0] ADA, ADB,
    input [35:0] DI,
    output [35:0] DO
);
    DPX9B #(
        .CONTENTS(CONTENTS), .BIT_WIDTH_0(BIT_WIDTH_0), .BIT_WIDTH_1(BIT_WIDTH_1),
        .READ_MODE1(READ_MODE), .BLK_SEL_0(BLK_SEL_0), .BLK_SEL_1(BLK_SEL_1)
    ) ram (
        .CLKA(CLKA), .CLKB(CLKB), .CEA(CEA), .CEB(CEB), .OCEA(1'b1), .OCEB(OCE), .WREA(1'b1),
        .WREB(1'b0), .RESETA(RESETA), .RESETB(RESETB), .BLKSELA(BLKSELA), .BLKSELB(BLKSELB),
        .ADA(ADA), .ADB(ADB), .DIA(DI), .DIB(36'd0), .DOA(), .DOB(DO)
    );
endmodule

module SPX9 #(
    parameter [64*288-1:0] CONTENTS = 0,
    parameter BIT_WIDTH = 36, READ_MODE = 0, WRITE_MODE = 0, BLK_SEL = 0, RESET_MODE = "SYNC"
) (
    input CLK, CE, OCE, RESET, WRE,
    input [2:0] BLKSEL,
    input [13:0] AD,
    input [35:0] DI,
    output [35:0] DO
);
    DPX9B #(
        .CONTENTS(CONTENTS), .BIT_WIDTH_0(BIT_WIDTH), .BIT_WIDTH_1(0), .READ_MODE0(READ_MODE),
        .WRITE_MODE0(WRITE_MODE), .BLK_SEL_0(BLK_SEL)
    ) ram (
        .CLKA(CLK), .CLKB(CLK), .CEA(CE), .CEB(1'b0), .OCEA(OCE), .OCEB(1'b0), .WREA(WRE),
        .WREB(1'b0), .RESETA(RESET), .RESETB(1'b0), .BLKSELA(BLKSEL), .BLKSELB(3'd0), .ADA(AD),
        .ADB(14'd0), .DIA(DI), .DIB(36'd0), .DOA(DO), .DOB()
    );
endmodule

module multiplier #(
    parameter BITS = 18, AREG = 0, BREG = 0, OUT_REG = 0, PIPE_REG = 0
) (
    input [BITS-1:0] A, B,
    input ASIGN, BSIGN, ASEL, BSEL, CE, CLK, RESET,
    output [2*BITS-1:0] DOUT
);
    initial if (PIPE_REG) $fatal(1, "PIPE_REG of a multiplier is not simulated");
    reg [BITS-1:0] a = 0, b = 0;
    reg [2*BITS-1:0] p = 0;
    wire [BITS-1:0] left = AREG ? a : A, right = BREG ? b : B;
    wire [2*BITS-1:0] product = {{BITS{ASIGN & left[BITS-1]}}, left}
                              * {{BITS{BSIGN & right[BITS-1]}}, right};
    always @(posedge CLK) begin
        if (RESET || ASEL || BSEL) $fatal(1, "a reset or a source of a multiplier is not simulated");
        if (CE) {a, b, p} <= {A, B, product};
    end
    assign DOUT = OUT_REG ? p : product;
endmodule

module MULT18X18 #(
    parameter AREG = 0, BREG = 0, OUT_REG = 0, PIPE_REG = 0
) (
    input [17:0] A, B, SIA, SIB,
    input ASIGN, BSIGN, ASEL, BSEL, CE, CLK, RESET,
    output [35:0] DOUT
);
    multiplier #(.AREG(AREG), .BREG(BREG), .OUT_REG(OUT_REG), .PIPE_REG(PIPE_REG)) m (
        .A(A), .B(B), .ASIGN(ASIGN), .BSIGN(BSIGN), .ASEL(ASEL), .BSEL(BSEL), .CE(CE), .CLK(CLK),
        .RESET(RESET), .DOUT(DOUT)
    );
endmodule

module MULT9X9 #(
    parameter AREG = 0, BREG = 0, OUT_REG = 0, PIPE_REG = 0
) (
    input [8:0] A, B, SIA, SIB,
    input ASIGN, BSIGN, ASEL, BSEL, CE, CLK, RESET,
    output [17:0] DOUT
);
    multiplier #(
        .BITS(9), .AREG(AREG), .BREG(BREG), .OUT_REG(OUT_REG), .PIPE_REG(PIPE_REG)
    ) m (
        .A(A), .B(B), .ASIGN(ASIGN), .BSIGN(BSIGN), .ASEL(ASEL), .BSEL(BSEL), .CE(CE), .CLK(CLK),
        .RESET(RESET), .DOUT(DOUT)
    );
endmodule
