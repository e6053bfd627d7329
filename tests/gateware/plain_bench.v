// A user's bench in plain Verilog for `core_sim.v`: nothing of SystemVerilog, no clocking blocks.
//
// Nothing is driven for BEFORE cycles, `rst` neither; with 0 the bench looks at power-up too. Then
// the commands of commands.hex are done, 64 bits each: what in 63:60, a number in 59:32, a word in
// 31:0.
//   0 end      1 offer the word, number = last of its record      2 number cycles of rst
//   3 write the word to address number      4 number cycles of nothing      5 read address number
// Lines: `O word last`, `R address word`, `RESET`, `X what` for a bit that is unknown after the
// first cycle of the first reset, `DONE`.

`timescale 1ns/1ps

module plain_bench;
    reg clk, rst;
    reg i_valid, o_ready, w_stb, known;
    reg [`WORD:0] i_payload;
    reg [9:0] addr;
    reg [`WORD-1:0] w_data;
    wire i_ready, o_valid, w_ack, saturated;
    wire [`WORD:0] o_payload;
    wire [`WORD-1:0] r_data;
    reg [63:0] commands [0:1023];
    reg [63:0] command;
    integer at, left;

    core dut (
        .clk(clk), .rst(rst),
        .i__payload(i_payload), .i__valid(i_valid), .i__ready(i_ready),
        .o__payload(o_payload), .o__valid(o_valid), .o__ready(o_ready),
        .bus__addr(addr), .bus__w_data(w_data), .bus__w_stb(w_stb), .bus__w_ack(w_ack),
        .bus__r_data(r_data), .restart(1'b0), .saturated_update(saturated)
    );

    initial clk = 0;
    always #5 clk = ~clk;

    always @(posedge clk) if (known) begin
        if (^{i_ready, o_valid, w_ack, saturated} === 1'bx)
            $display("X handshake %b", {i_ready, o_valid, w_ack, saturated});
        if (^o_payload === 1'bx) $display("X o__payload %h", o_payload);
        if (^r_data === 1'bx) $display("X bus__r_data %h", r_data);
        if (!rst && o_valid && o_ready)
            $display("O %h %b", o_payload[`WORD-1:0], o_payload[`WORD]);
    end

    // What a command drives changes a little after the edge.
    task wait_cycles;
        input integer count;
        begin
            repeat (count) @(posedge clk);
            #1;
        end
    endtask

    task wait_for;
        input integer what;
        begin
            left = 5000;
            @(posedge clk);
            while (!(what == 1 ? i_ready : w_ack) && left > 0) begin
                left = left - 1;
                @(posedge clk);
            end
            if (left == 0) begin $display("HUNG %0d", what); $finish; end
            #1;
        end
    endtask

    initial begin
        $readmemh("commands.hex", commands);
        known = `BEFORE == 0; at = 0;
        wait_cycles(`BEFORE);
        command = commands[0];
        while (command[63:60] != 0) begin
            case (command[63:60])
                1: begin
                    i_valid = 1; i_payload = {command[32], command[`WORD-1:0]};
                    wait_for(1);
                    i_valid = 0;
                end
                2: begin
                    $display("RESET");
                    rst = 1; i_valid = 0; o_ready = 1; w_stb = 0; addr = 512; w_data = 0;
                    i_payload = 0;
                    wait_cycles(1);
                    known = 1;
                    wait_cycles(command[59:32] - 1);
                    rst = 0;
                end
                3: begin
                    addr = command[41:32]; w_data = command[`WORD-1:0]; w_stb = 1;
                    wait_for(3);
                    w_stb = 0;
                end
                4: wait_cycles(command[59:32]);
                5: begin
                    addr = command[41:32];
                    wait_cycles(1);
                    $display("R %0d %h", addr, r_data);
                end
            endcase
            at = at + 1;
            command = commands[at];
        end
        $display("DONE");
        $finish;
    end
endmodule
